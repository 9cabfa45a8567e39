"""The headers: no two types have one name. The linker would take the functions of one for the other's."""
import collections
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parent.parent
TYPE = re.compile(r"^(?:struct|class|enum class) (\w+)[^;{]*\{", re.MULTILINE)
NAMESPACE = re.compile(r"^namespace ([\w:]+) \{", re.MULTILINE)


def test_no_two_types_have_one_name():
    found = collections.defaultdict(list)
    for folder in ("include", "src"):
        for header in sorted((ROOT / folder).rglob("*.h")):
            text = header.read_text()
            namespace = NAMESPACE.findall(text)
            for name in TYPE.findall(text):
                found[namespace[-1] if namespace else "", name].append(str(header.relative_to(ROOT)))
    assert len(found) > 100
    assert {name: headers for name, headers in found.items() if len(headers) > 1} == {}
