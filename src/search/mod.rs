//! The search: Bees Algorithm, then a Levenberg-Marquardt polish.
