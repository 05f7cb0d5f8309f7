"""PySC2 4.0.0 on this Python: it imports, works as its authors tested it, and nothing else is changed."""

from __future__ import annotations

import random
import subprocess
import sys

import pytest

from khala_bridge.compat import old_shuffle, protobuf_kind

IMPORT = "import khala_bridge.compat"
UNCHANGED = f"""
import os, random, sys, warnings
filters, shuffle, environ, path = list(warnings.filters), random.shuffle, dict(os.environ), list(sys.path)
{IMPORT}
assert random.shuffle == shuffle, random.shuffle
assert warnings.filters == filters
assert dict(os.environ) == environ
assert sys.path == path
"""
VIDEO = f"""
import sys, warnings
{IMPORT}
assert "scipy" not in sys.modules and "pysc2.lib.video_writer" not in sys.modules
warnings.simplefilter("ignore")
from pysc2.lib import renderer_human, video_writer
assert renderer_human.video_writer.VideoWriter is video_writer.VideoWriter
assert "scipy" in sys.modules
"""
OWN_TESTS = ("lib.features_test", "lib.named_array_test", "lib.point_test", "tests.dummy_observation_test")
RUN_OWN_TESTS = f"""
import sys, unittest
{IMPORT}
from absl import flags
flags.FLAGS.mark_as_parsed()
for name in sys.argv[1:]:
    suite = unittest.defaultTestLoader.loadTestsFromName("pysc2." + name)
    assert suite.countTestCases() > 20, name
    result = unittest.TextTestRunner().run(suite)
    assert result.wasSuccessful(), name
"""


def run(code: str, *args: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", code, *args], capture_output=True, text=True, check=False, timeout=60
    )


def test_the_import_is_silent_and_changes_nothing_even_when_warnings_are_errors() -> None:
    done = run(UNCHANGED)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_scipy_is_imported_when_a_video_is_written_and_not_before() -> None:
    done = run(VIDEO)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_unit_tests_of_pysc2_pass() -> None:
    done = run(RUN_OWN_TESTS, *OWN_TESTS)
    assert done.returncode == 0, done.stderr


def test_the_old_shuffle_draws_as_python_3_10_did() -> None:
    palette = list(range(8))
    before = random.shuffle
    with old_shuffle():
        random.shuffle(palette, lambda: 0.5)  # type: ignore[call-arg]  # the form that Python 3.11 removed
    assert palette == [0, 5, 1, 7, 2, 6, 3, 4]  # swaps of i and (i + 1) // 2 for i = 7 to 1, by hand
    assert random.shuffle == before


def test_the_shuffle_is_given_back_after_an_error() -> None:
    before = random.shuffle
    with pytest.raises(ZeroDivisionError), old_shuffle():
        raise ZeroDivisionError
    assert random.shuffle == before


def test_protobuf_is_the_fast_one() -> None:
    assert protobuf_kind() == "upb"
