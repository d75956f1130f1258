"""What LD2 shows, in the words of the board's README, from when it went on and off."""

PERIOD_S = 2.0
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


def shown(board, periods=2):
    """Lets the board run for some periods, and says what was to be seen."""
    start_s = board.now_s
    board.run(periods * PERIOD_S)
    found = segments(board, start_s, start_s + periods * PERIOD_S)
    if len(found) == 1:
        return "on" if found[0][0] else "dark"
    beginnings = sum(level for level, _ in found[1:])
    per_period = round(beginnings / periods)
    lit = [seconds for level, seconds in found[1:-1] if level]
    dark = [seconds for level, seconds in found[1:-1] if not level]
    if near(lit, 0.5) and near(dark, 0.5):
        return "half a second on and off"
    if near(lit, 0.1) and near(dark, 0.1):
        return "flickers"
    if near(lit, 0.1):
        return counted(per_period, "short flash", "es")
    if near(dark, 0.2):
        return "on with " + counted(per_period, "gap", "s")
    return f"{found}"


def near(seconds, wanted_s):
    """All as long as they should be, to what the loop comes round by."""
    return bool(seconds) and all(abs(length_s - wanted_s) < 0.06 for length_s in seconds)


def counted(number, word, plural):
    return f"{NUMBERS[number]} {word}{plural if number > 1 else ''}"
