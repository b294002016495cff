"""The chain rule among vehicles and posts at the road: messages, who says what to whom, and when."""
