"""One ledger of places and requests, in plain objects; rules that give a reason or nothing."""
