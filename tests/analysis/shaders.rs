//! Shaders as they are shipped.
