# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The executables as users start them: how they end, and what they say of a bad scene."""

from importlib import import_module
import re
import signal
import time

import pytest
from ros_harness import module, Process
from scenes import ROOT

NODES = ('crank_driver', 'kinematics', 'servo_inverse')
EXECUTABLES = (*NODES, 'scene', 'viewer')


@pytest.mark.parametrize('command, file', [
    ('c_code.cli', 'SCENE'), ('c_code.transmission', 'SCENE'), ('render.cli', 'SCENE'),
    ('robot_files.cli', 'FILE'), ('robot_model.cli', '[SCENE]')])
def test_the_help_of_a_command_names_its_file_and_explains_each_of_its_options(
        capsys, command, file):
    with pytest.raises(SystemExit):
        import_module(f'linkage_ros.{command}').main(['--help'])
    printed = capsys.readouterr().out
    assert printed.partition('\n\n')[0].endswith(f' {file}')
    options = re.findall(r'^  (-.*(?:\n {4}.*)*)', printed, re.M)
    for option in options:
        assert re.fullmatch(r'-\S+(?: \S+)*(?:  +|\n +)\w[^\n]{3,}(\n.*)*', option), option
    assert len(options) > 3


def test_a_program_that_a_node_ran_in_gets_its_signals_back():
    from linkage_ros.nodes.shutdown import ShutdownHandler, TIMEOUT_S

    def handlers():
        return [signal.getsignal(stop) for stop in (signal.SIGINT, signal.SIGTERM)]

    before = handlers()
    with ShutdownHandler() as shutdown:
        assert not set(handlers()) & set(before) and not shutdown.is_over
        signal.raise_signal(signal.SIGTERM)
        assert shutdown.is_over
        # What would end the process, were it busy.
        assert 0.0 < signal.getitimer(signal.ITIMER_REAL)[0] <= TIMEOUT_S
    assert handlers() == before and signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


@pytest.mark.nightly
@pytest.mark.parametrize('stop', [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize('name', EXECUTABLES)
def test_more_signals_than_one_end_a_node_as_quietly(name, stop):
    """A terminal sends one to the whole group, and a launcher one more to each of it."""
    process = Process(name, ROOT / 'config' / 'all.yaml')
    process.line()
    while not process.has_ended:
        process.interrupt(stop)
        time.sleep(1e-4)
    code, printed = process.end()
    assert (code, 'Traceback' in printed, 'rror' in printed) == (0, False, False), printed


@pytest.mark.nightly(all_but=1)
@pytest.mark.parametrize('name', EXECUTABLES)
def test_what_python_does_at_its_end_holds_up_no_node(tmp_path, name):
    """However it is started: much garbage takes seconds."""
    (tmp_path / 'sitecustomize.py').write_text(
        'import atexit, time\natexit.register(time.sleep, 100.0)\n')
    process = Process(name, ROOT / 'config' / 'all.yaml', first=tmp_path, as_module=True)
    # Whoever follows starts with the values of `kinematics`.
    for node in ('kinematics', 'servo_inverse', 'crank_driver') if name == 'scene' else (name,):
        assert f'[{node}]: ' in process.line()
    process.interrupt(signal.SIGINT)
    assert process.end() == (0, '')


@pytest.mark.nightly(all_but=3)
@pytest.mark.parametrize('stop', [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize('name', EXECUTABLES)
def test_a_signal_ends_what_is_still_being_imported(tmp_path, name, stop):
    (tmp_path / 'rclpy.py').write_text(
        "import time\nprint('importing', flush=True)\nwhile True:\n    time.sleep(0.01)\n")
    process = Process(name, ROOT / 'config' / 'all.yaml', first=tmp_path)
    assert process.line() == 'importing\n'
    process.interrupt(stop)
    assert process.end() == (0, '')


ARGUMENTS = [
    (['--foo'], "unknown argument '--foo': .* of ROS: --ros-args --params-file SCENE"),
    (['x' * 10 ** 4], "bad arguments: unknown argument 'xxx"),
    (['--ros-args', '--bar'], 'bad arguments: .*--bar'),
    (['--ros-args', '-p', 'rate'], "bad arguments: .*Couldn't parse parameter override"),
    (['--ros-args', '-r', '__ns:=two words'], 'bad arguments: .*remap'),
    (['--ros-args', '--params-file', 'nowhere.yaml'], 'bad arguments: .*nowhere.yaml')]


@pytest.mark.parametrize('name, arguments, reason', [
    *((name, *row) for name in NODES for row in ARGUMENTS),
    ('scene', ['--ros-args', '-p', 'mechanisms:=[leg]'], 'leg.type must be a text'),
    ('viewer', ['--ros-args', '-p', 'use_sim_time:=5'], "'use_sim_time' to '5'")])
def test_arguments_that_there_are_not_end_in_one_sentence(capfd, name, arguments, reason):
    main = import_module(module(name)).main
    assert main([name, *arguments]) == 1
    printed = capfd.readouterr().err
    fatal, = (line for line in printed.splitlines() if '[FATAL]' in line)
    assert re.search(reason, fatal) and len(fatal) < 400 and 'Traceback' not in printed
