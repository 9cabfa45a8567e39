"""Experiments, reports and fault campaign of rio_t: what runs the programs and reads what they write."""
import pkgutil

# The messages (rio_t.msg) are generated elsewhere, into a package of the same name.
__path__ = pkgutil.extend_path(__path__, __name__)
