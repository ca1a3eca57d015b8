"""Reads records in one pipeline; each stage says what it assumed, and `look` prints that list.

| stage | file | what it does |
|---|---|---|
| bytes | `source.py` | unpacks, decodes, and hands out lines |
| dialect | `dialect.py` | finds what separates cells, the decimal mark, the header and the units |
| table | `table.py`, `cells.py` | columns with names and units, numbers that are checked |
| roles | `roles.py` | which column is the time, the drive, the position |
| record | `record.py` | what is handed out, with all that was assumed |

`read.py` goes through them. Each file of `formats` reads one family of formats into a table: a new
format is one file, and a line in the list of `formats/__init__.py`.
"""
