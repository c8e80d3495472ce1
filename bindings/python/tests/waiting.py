"""Waiting for what another thread or process does."""

import time

#: Longest time to wait for something that comes within milliseconds on a quiet machine [s].
PATIENCE = 60


def until(condition):
    """Wait until a condition holds."""
    begun = time.monotonic()
    while not condition():
        assert time.monotonic() - begun < PATIENCE, "it never came"
        time.sleep(0.002)
