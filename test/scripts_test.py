"""Scripts for developers, each in a small tree of its own with stand-ins for what it calls."""
import os
import re
import signal
import subprocess
import time

import pytest

USUAL_PATH = "export PATH=/usr/bin:$PATH"


class Tree:
    def __init__(self, root, scripts):
        self.root, self.scripts = root, scripts
        self.environment = {key: value for key, value in os.environ.items() if not key.startswith("RIO_T_")}
        for folder in ("scripts", "bin"):
            (root / folder).mkdir(parents=True)
        self.program("scripts/install_dependencies.sh", "")

    def program(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"#!/bin/bash\n{text}\n")
        path.chmod(0o755)

    def script(self, name):
        """The script, which finds the stand-ins in bin/ first."""
        text = (self.scripts / name).read_text()
        assert USUAL_PATH in text
        self.program(f"scripts/{name}", text.replace(USUAL_PATH, f"export PATH='{self.root}/bin':/usr/bin:$PATH"))
        return self.root / "scripts" / name

    def run(self, name, *words, **environment):
        return subprocess.run([self.script(name), *words], env={**self.environment, **environment}, text=True,
                              capture_output=True, check=False)


@pytest.fixture(name="tree")
def tree_fixture(tmp_path, scripts):
    return Tree(tmp_path / "a [tree]", scripts)


def test_warnings_are_errors_in_a_build_folder_that_is_there(tree):
    (tree.root / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.10)\nproject(tree NONE)\n"
                                              "option(RIO_T_WERROR \"\" OFF)\n")
    for words, given, expected in ((["-DCMAKE_BUILD_TYPE=RelWithDebInfo"], {}, "OFF"), ([], {"RIO_T_WERROR": "ON"}, "ON"),
                                   ([], {}, "ON"), ([], {"RIO_T_WERROR": "OFF"}, "OFF")):
        done = tree.run("build.sh", *words, **given)
        assert done.returncode == 0, done.stderr
        cache = (tree.root / "build/CMakeCache.txt").read_text()
        assert f"\nRIO_T_WERROR:BOOL={expected}\n" in cache
        assert re.search("^CMAKE_BUILD_TYPE:.*=RelWithDebInfo$", cache, re.MULTILINE), "of the first call"


def lint(tree, known):
    for folder in ("src", "test", "fuzz", "bench"):
        (tree.root / folder).mkdir()
    (tree.root / "src/one.cpp").write_text("")
    tree.program("bin/cmake", f"""printf '{{"file": "%s/{known}"}}' "$PWD" >build/lint/compile_commands.json""")
    for name in ("catkin_lint", "clang-format-14", "clang-tidy-14", "cppcheck"):
        tree.program(f"bin/{name}", "")
    return tree.run("lint.sh")


def test_sources_are_linted_in_any_folder(tree):
    done = lint(tree, "src/one.cpp")
    assert done.returncode == 0, done.stderr
    assert "1 files, 1 of them with clang-tidy and cppcheck: no finding" in done.stdout


def test_lint_that_knows_no_source_fails(tree):
    done = lint(tree, "src/another.cpp")
    assert done.returncode == 1
    assert "none of 1 files is a source" in done.stderr and "no finding" not in done.stdout


def is_there(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def test_fuzzers_end_with_their_script(tree):
    names = ("point_cloud", "parameters")
    (tree.root / "config").mkdir()
    (tree.root / "config/a.yaml").write_text("key: 1\n")
    tree.program("bin/cmake", "")
    for name in names:  # they take a name only when it is whole
        tree.program(f"build/fuzz/devel/lib/rio_t/{name}_fuzzer", f"echo $$ >{name}.new; mv {name}.new {name}.id; exec sleep 600")
    ids = [tree.root / f"{name}.id" for name in names]
    with subprocess.Popen([tree.script("fuzz.sh")], env=tree.environment) as script:
        deadline = time.monotonic() + 60.0
        while not all(path.exists() for path in ids) and time.monotonic() < deadline:
            time.sleep(0.01)
        script.terminate()
    fuzzers = [int(path.read_text()) for path in ids]
    left = [fuzzer for fuzzer in fuzzers if is_there(fuzzer)]
    for fuzzer in left:
        os.kill(fuzzer, signal.SIGKILL)
    assert left == []
