"""The theory of Zhou et al. 2020 as code, and the exact answers that judge it."""
