"""What LD2 shows, in the words of the board's README, from when it went on and off."""

PERIOD_S = 2.0
SHORT_S = 0.2
"""A flash lasts 0.1 s, a gap 0.2 s; the pause behind several is longer."""
NUMBERS = ["no", "one", "two", "three", "four"]


def segments(board, start_s, end_s):
    """(level, seconds) one after the other; the first and the last may be cut off."""
    edges = [(at / 1e9, level) for at, pin, level in board.chip.gpio["A"].history if pin == 5]
    found, since_s, level = [], start_s, board.led_is_on(start_s)
    for at_s, new in edges:
        if start_s < at_s < end_s and new != level:
            found.append((level, at_s - since_s))
            since_s, level = at_s, new
    return found + [(level, end_s - since_s)]


def shown(board, periods=3):
    """Lets the board run for some periods, and says what was to be seen."""
    start_s = board.now_s
    board.run(periods * PERIOD_S)
    found = segments(board, start_s, board.now_s)
    if len(found) == 1:
        return "on" if found[0][0] else "dark"
    whole = found[1:-1]
    lit = [seconds for level, seconds in whole if level]
    dark = [seconds for level, seconds in whole if not level]
    if near(lit, 0.5) and near(dark, 0.5):
        return "half a second on and off"
    if near(lit, 0.1) and near(dark, 0.1):
        return "flickers"
    per_period = PERIOD_S / sum(lit + dark)
    if near(lit, 0.1):
        return counted(len(lit) * per_period, "short flash", "es")
    if near(dark, 0.2):
        return "on with " + counted(len(dark) * per_period, "gap", "s")
    return f"{found}"


def near(seconds, wanted_s):
    """All as long as they should be, to what the loop comes round by."""
    return bool(seconds) and all(abs(length_s - wanted_s) < 0.06 for length_s in seconds)


def counted(number, word, plural):
    return f"{NUMBERS[round(number)]} {word}{plural if round(number) > 1 else ''}"
