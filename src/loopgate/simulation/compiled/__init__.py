"""The gated drive in compiled code: the commonest case, certified by the chain rule alone, at speed."""
