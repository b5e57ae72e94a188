"""How Sphinx builds the site from these pages: `make site`. Every warning is an error there, broken links included."""

project = "iibr"
extensions = ["myst_parser"]
myst_heading_anchors = 4
html_theme = "alabaster"
html_theme_options = {"page_width": "1100px", "sidebar_width": "240px"}
html_show_copyright = False
html_show_sourcelink = False
