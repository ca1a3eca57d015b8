"""Reads records in one pipeline; each stage says what it assumed, and `look` prints that list.

| stage | file | what it does |
|---|---|---|
| bytes | `source.py`, `joined.py` | unpacks, decodes, and hands out lines; joins files |
| dialect | `dialect.py` | finds what separates cells, the decimal mark, the header and the units |
| | `marks.py`, `names.py`, `first_row.py`, `preamble.py` | what cells and rows tell |
| | `layout_doubts.py` | what speaks against the table that was found |
| table | `table.py`, `cells.py` | columns with names and units, numbers that are checked |
| | `factors.py` | factors and offsets beside the columns |
| roles | `roles.py` | which column is the time, the drive, the position |
| | `clocks.py`, `clock_doubts.py` | what runs like a clock, and what speaks against the time |
| record | `record.py` | what is handed out, with all that was assumed |

`read.py` goes through them. Each file of `formats` reads one family of formats into a table: a new
format is one file, and a line in the list of `formats/__init__.py`.
"""
