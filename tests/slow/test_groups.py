"""Every long check belongs to a group, so that `make test-slow` runs it."""

from __future__ import annotations

from importlib.util import find_spec

from tests.slow.groups import COMMANDS, group_of, slow_files, steps


def test_every_file_with_slow_tests_is_in_a_group() -> None:
    assert [file for file in slow_files() if group_of(file) is None] == []
    planned = [step.arguments[0] for step in steps() if step.is_pytest]
    assert sorted(planned) == slow_files()


def test_every_command_is_a_module_that_exists() -> None:
    assert all(find_spec(command[0]) for commands in COMMANDS.values() for command in commands)
