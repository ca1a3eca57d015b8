"""What a notebook shows of an object: small tables in HTML. Needs nothing but numpy."""
