//! Measurements: records in time and datasheet curves, with channels, units and checks.
