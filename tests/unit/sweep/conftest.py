"""A runner without SUMO, by the name that workers import it under."""

from pathlib import Path

import pytest


@pytest.fixture
def fake_runner() -> str:
    return f"{Path(__file__).with_name('fake_runner.py')}:run"
