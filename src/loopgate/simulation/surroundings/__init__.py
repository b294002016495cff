"""What gated vehicles meet on the road: traffic lights that they obey, and ordinary traffic."""
