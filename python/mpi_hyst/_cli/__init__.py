"""The command line. A command is a file: its options, what it reads, does and writes.

`commands` lists them. `options` says how an option is declared. They share `terminal` (what they
say), `inputs` and `stage` (what they read) and `outputs` (what they write). `identify_records`
reads the records of `identify`.
"""
