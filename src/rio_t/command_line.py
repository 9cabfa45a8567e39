"""What the command lines of the Python programs share."""
import argparse
import pathlib
from xml.etree import ElementTree


def version():
    """That of package.xml, in a clone or beside an installed package."""
    here = pathlib.Path(__file__).resolve()
    for folder in here.parents:
        for manifest in (folder / "package.xml", folder / "share" / "rio_t" / "package.xml"):
            if manifest.is_file():
                return ElementTree.parse(manifest).findtext("version")
    return "unknown"


class Parser(argparse.ArgumentParser):
    """Keeps the lines of description and examples, and has --version."""

    def __init__(self, **options):
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, **options)
        self.add_argument("--version", action="version", version=f"{self.prog} of rio_t {version()}")
