"""What the command lines of the Python programs share."""
import argparse
import pathlib
from xml.etree import ElementTree


def package_folder():
    """Where package.xml and config/ of rio_t are: a clone, or share/rio_t of an installed package."""
    here = pathlib.Path(__file__).resolve()
    folders = (folder for parent in here.parents for folder in (parent, parent / "share" / "rio_t"))
    return next((folder for folder in folders if (folder / "package.xml").is_file()), None)


def version():
    """The version in package.xml."""
    folder = package_folder()
    return ElementTree.parse(folder / "package.xml").findtext("version") if folder else "unknown"


class Parser(argparse.ArgumentParser):
    """Keeps the lines of description and examples, and has --version."""

    def __init__(self, **options):
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, **options)
        self.add_argument("--version", action="version", version=f"{self.prog} of rio_t {version()}")
