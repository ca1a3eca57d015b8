"""Settings of Sphinx for the pages in this folder: `make docs`."""

from __future__ import annotations

import logging
import os
import sys
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).parent / "_ext"))
# Pages call `mpi-hyst`: that of the interpreter which builds them.
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
# Kernels serve this machine only: that of `_jupyter` does not warn of sockets without encryption.
os.environ["JUPYTER_PATH"] = str(Path(__file__).parent / "_jupyter")
logging.getLogger("traitlets").setLevel(logging.WARNING)  # not a line for every page that runs

project = "mpi_hyst"
author = "The mpi_hyst developers"
copyright = f"2026, {author}"  # noqa: A001 (Sphinx names it so)
try:
    release = metadata.version("mpi_hyst")
except metadata.PackageNotFoundError:
    release = "of a source folder"

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",  # formulas show without a network
    "numpydoc",
    "myst_nb",
    "sphinx_gallery.gen_gallery",
    "sphinx_click",
    "sphinx_copybutton",
    "docstrings",
    "listings",
    "shell_cells",
]
exclude_patterns = ["_ext", "_jupyter", "gallery", "auto_gallery/*.ipynb"]

# Inventories of other projects come from the network. A build without it must give no warning,
# so they are there only if they are asked for.
if os.environ.get("DOCS_INTERSPHINX") == "1":
    extensions.append("sphinx.ext.intersphinx")
    intersphinx_mapping = {
        "python": ("https://docs.python.org/3", None),
        "numpy": ("https://numpy.org/doc/stable", None),
        "scipy": ("https://docs.scipy.org/doc/scipy", None),
        "matplotlib": ("https://matplotlib.org/stable", None),
    }

smartquotes_action = "q"  # `--dt` in the help of a command keeps both its hyphens
default_role = "py:obj"  # names in docstrings are code, and links where there is such an object

autosummary_generate = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

myst_enable_extensions = ["amsmath", "deflist", "dollarmath", "fieldlist"]
myst_heading_anchors = 3
# Every page runs anew at every build: what is shown is what this version does.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 600  # seconds for a cell: on a machine that is busy with other work
nb_execution_show_tb = True
nb_merge_streams = True
suppress_warnings = [
    "config.cache"
]  # a class for the order of the gallery cannot be kept between builds

sphinx_gallery_conf = {
    "examples_dirs": "gallery",
    "gallery_dirs": "auto_gallery",
    "filename_pattern": r"plot_",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "remove_config_comments": True,
    # Times of this machine say nothing to a reader. Their page would load scripts from elsewhere.
    "write_computation_times": False,
    "min_reported_time": 1e9,
    "show_signature": False,
    "capture_repr": (),  # pages show figures and what is printed
}

copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
copybutton_exclude = ".linenos, .gp, .go"

math_number_all = False
math_eqref_format = "equation ({number})"
numfig = True

html_theme = "furo"
html_title = "mpi_hyst"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_theme_options = {"navigation_with_keys": True}
html_show_sphinx = False

linkcheck_timeout = 20
linkcheck_retries = 2
# doi.org sends programs to publishers that refuse them.
linkcheck_ignore = [r"https://doi\.org/.*"]


def setup(app: Sphinx) -> None:
    """Let pages be read at the same time: this extension, which does not say so, adds a script."""
    app.extensions["sphinx-mathjax-offline"].parallel_read_safe = True
