"""Which pins are inputs of which timers, by alternate function (datasheet of the STM32G474xE, table 13)."""

TIMER_INPUTS = {
    ("A", 0): {1: ("TIM2", 1), 2: ("TIM5", 1)},
    ("A", 1): {1: ("TIM2", 2), 2: ("TIM5", 2)},
    ("A", 2): {1: ("TIM2", 3), 2: ("TIM5", 3), 9: ("TIM15", 1)},
    ("A", 3): {1: ("TIM2", 4), 2: ("TIM5", 4), 9: ("TIM15", 2)},
    ("A", 5): {1: ("TIM2", 1)},
    ("A", 6): {1: ("TIM16", 1), 2: ("TIM3", 1)},
    ("A", 7): {1: ("TIM17", 1), 2: ("TIM3", 2)},
    ("A", 15): {1: ("TIM2", 1)},
    ("B", 0): {2: ("TIM3", 3)},
    ("B", 1): {2: ("TIM3", 4)},
    ("B", 3): {1: ("TIM2", 2)},
    ("B", 4): {1: ("TIM16", 1), 2: ("TIM3", 1)},
    ("B", 5): {2: ("TIM3", 2)},
    ("B", 6): {2: ("TIM4", 1)},
    ("B", 7): {2: ("TIM4", 2)},
    ("B", 8): {1: ("TIM16", 1), 2: ("TIM4", 3)},
    ("B", 9): {1: ("TIM17", 1), 2: ("TIM4", 4)},
    ("B", 10): {1: ("TIM2", 3)},
    ("B", 11): {1: ("TIM2", 4)},
    ("B", 14): {1: ("TIM15", 1)},
    ("B", 15): {1: ("TIM15", 2)},
    ("C", 6): {2: ("TIM3", 1)},
    ("C", 7): {2: ("TIM3", 2)},
    ("C", 8): {2: ("TIM3", 3)},
    ("C", 9): {2: ("TIM3", 4)},
}


def timer_inputs(letter, pin, function):
    """(timer, channel) that a pin feeds with an alternate function."""
    found = TIMER_INPUTS.get((letter, pin), {}).get(function)
    return [found] if found else []
