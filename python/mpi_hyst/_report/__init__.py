"""Reports. A page is a file with its tables and figures, and a template with its text.

`page` fills the templates; `page.html.j2` is their frame, `blocks.html.j2` what sections are made
of. Figures have one style (`canvas`) and are of records (`traces`), models (`models`), the coupled
play (`coupled_play`) and loops (`closed_loop`). `summary` says in words what identification found
in `records`, and `notebook` shows objects without any extra.
"""
