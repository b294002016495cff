"""The chain rule decided by messages: vehicles ask posts at the road for slots, without a central program."""
