"""What c does on real people: recordings, entrants and scores."""
