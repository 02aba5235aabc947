//! Functions for scripts.
