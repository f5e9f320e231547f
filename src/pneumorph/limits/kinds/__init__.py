"""One file for each kind of limit: words, values, derivatives, enclosures, and the share that is used."""
