# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The executor that runs the nodes: which one it is, and how it ends."""

from pathlib import Path
import signal
import subprocess
import sys
import textwrap

from linkage_ros.nodes import scene_node
import pytest
from rclpy.executors import SingleThreadedExecutor

pytestmark = pytest.mark.nightly(all_but=0)

def test_the_executor_that_waits_for_events_is_used_where_there_is_one():
    experimental = pytest.importorskip('rclpy.experimental')
    assert scene_node.Executor is experimental.EventsExecutor


def test_where_there_is_no_such_executor_the_plain_one_is_used():
    done = python("""
        import sys
        sys.modules['rclpy.experimental'] = None
        from linkage_ros.nodes import scene_node
        from rclpy.executors import SingleThreadedExecutor
        assert scene_node.Executor is SingleThreadedExecutor and scene_node.AWAITS
        """)
    assert (done.returncode, done.stderr) == (0, '')


@pytest.mark.parametrize('stop', [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize('plain', [False, True])
def test_a_signal_amid_a_callback_ends_a_node_quietly(stop, plain):
    done = python(f"""
        import signal, sys
        from linkage_ros.nodes import scene_node
        from linkage_ros.nodes.crank_driver import CrankDriver
        import rclpy
        from rclpy.executors import SingleThreadedExecutor
        from sensor_msgs.msg import JointState

        class Ended(CrankDriver):
            def __init__(self):
                super().__init__()
                self.create_subscription(JointState, 'crank_states', print, 1)

            def _tick(self):
                if self._publisher.has_subscribers:
                    signal.raise_signal({int(stop)})
                    while rclpy.ok():
                        pass
                super()._tick()

        executor = SingleThreadedExecutor if {plain} else scene_node.Executor
        sys.exit(scene_node.run([Ended], 'ended', [], executor))
        """)
    assert (done.returncode, done.stdout) == (0, '')
    assert done.stderr.count('\n') == 1 and ': ready: ' in done.stderr


@pytest.mark.parametrize('executor', [scene_node.Executor, SingleThreadedExecutor])
def test_a_programming_error_is_logged_once_and_ends_nothing(executor):
    done = python(f"""
        import signal
        from linkage_ros.nodes import scene_node
        from rclpy import executors, node as rclpy_node

        class Wrong(rclpy_node.Node):
            def __init__(self):
                super().__init__('wrong')
                self._calls = 0
                self.create_timer(0.01, self._tick)

            def _tick(self):
                self._calls += 1
                if self._calls > 20:
                    signal.raise_signal(signal.SIGINT)
                1 // 0

        executor = scene_node.Executor if {executor is scene_node.Executor} else \\
            executors.SingleThreadedExecutor
        raise SystemExit(scene_node.run([Wrong], 'wrong', executor_class=executor))
        """)
    assert done.returncode == 0
    assert done.stderr.count('internal error in a request, which is dropped: ZeroDivision') == 1


def python(code):
    """Run code in a Python of its own."""
    return subprocess.run(
        [sys.executable, '-c', textwrap.dedent(code)], cwd=Path(__file__).parents[1],
        capture_output=True, text=True, timeout=60)
