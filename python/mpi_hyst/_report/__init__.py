"""Reports: a room for each, and the page and the plots that they share."""
