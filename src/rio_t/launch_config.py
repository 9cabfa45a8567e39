"""The configuration of a launch file, for <param command="...">, which roslaunch runs while it reads the file.

Prints the configuration that the argument `config` names, and refuses arguments that the launch file does not have:
roslaunch itself takes every NAME:=VALUE on its command line, and a misspelt one would change nothing without a word.
It also refuses a configuration that does not exist: the node would end, and roslaunch would go on. And it refuses a bag
that does not exist, and a number that rosbag play does not take: the player would end, and the node would wait for ever."""
import argparse
import difflib
import math
import os
import pathlib
import sys
import xml.etree.ElementTree as ElementTree

from .command_line import package_folder
from .errors import RioTError


def config_path(name, folder, package_configs):
    """The configuration for the node: an absolute path (a relative `name` counts from `folder`), or a name of the package's."""
    path = pathlib.Path(folder, os.path.expanduser(name))
    if path.is_file():
        return str(path.resolve())
    if "/" in name:
        raise RioTError(f"config:={name}: there is no file {path}")
    if not any((package_configs / (name + extension)).is_file() for extension in ("", ".yaml")):
        names = ", ".join(sorted(file.stem for file in package_configs.glob("*.yaml")))
        raise RioTError(f"config:={name}: there is no file {path}, and the package has {names}")
    return name


def check_arguments(words, launch_folder):
    """Raises RioTError if `words`, the command line of roslaunch, starts a launch file of this package with an argument
    that the file does not have."""
    files = [launch_folder / pathlib.Path(word).name for before, word in zip(["", *words], words)
             if word.endswith(".launch") and (before == "rio_t" or pathlib.Path(word).resolve().parent == launch_folder.resolve())]
    files = [file for file in files if file.is_file()]
    if not files:
        return  # somebody else's launch file, which roslaunch checks where it includes ours
    known = [arg.get("name") for arg in ElementTree.parse(files[0]).getroot().findall("arg") if arg.get("value") is None]
    for word in words:
        name, assigned, _ = word.partition(":=")
        if not assigned or name.startswith("_") or name in known:
            continue
        close = difflib.get_close_matches(name, known, 1)
        hint = f"did you mean {close[0]}:= ? " if close else ""
        raise RioTError(f"{files[0].name} has no argument {name}:= ; {hint}It has {', '.join(known)}; roslaunch --ros-args "
                        f"rio_t {files[0].name} describes them.")


def check_player(words):
    """Raises RioTError if an argument in `words` is no number that rosbag play takes."""
    for word in words:
        name, assigned, value = word.partition(":=")
        if assigned and name in ("bag_rate", "clock_hz", "bag_start"):
            try:
                number = float(value)
            except ValueError:
                number = math.nan
            least = 0.0 if name == "bag_start" else sys.float_info.min
            if not least <= number < math.inf:
                raise RioTError(f"{word}: expected a number {'of at least' if name == 'bag_start' else 'above'} 0")


def words_of(process):
    """The command line of a process; empty if it has ended or belongs to somebody else."""
    try:
        return pathlib.Path(f"/proc/{process}/cmdline").read_bytes().decode(errors="replace").rstrip("\0").split("\0")
    except OSError:
        return []


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("config", help="a path, absolute or from where roslaunch was called, or a name of the package's config/")
    parser.add_argument("launch_folder", type=pathlib.Path, help="where the launch file is")
    parser.add_argument("--bag", default="", help="the bag that is to be played; empty: none")
    options = parser.parse_args(arguments)
    try:
        words = words_of(os.getppid())
        check_arguments(words, options.launch_folder)
        check_player(words)
        config = config_path(options.config, os.getcwd(), package_folder() / "config")
        if options.bag and not pathlib.Path(os.path.expanduser(options.bag)).is_file():
            raise RioTError(f"bag {options.bag}: no such file")
        print(config, end="")
    except RioTError as error:
        print(f"rio_t: {error}", file=sys.stderr)
        return 1
    return 0
