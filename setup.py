"""The Python package of rio_t for catkin, which reads this file: catkin_python_setup() in CMakeLists.txt."""
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=["rio_t", "rio_t.experiments", "rio_t.faults", "rio_t.report"],
                                package_dir={"": "src"}))
