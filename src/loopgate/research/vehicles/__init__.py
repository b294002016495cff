"""The messages of `loopgate.vehicles`, looked at in every order in which they can come, or not come."""
