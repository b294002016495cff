"""Controls vehicles on the road: a ledger answers their requests for places by rules."""
