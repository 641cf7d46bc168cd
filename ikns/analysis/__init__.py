"""Analysis of recorded motions: learned against analytic null spaces, and variance."""
