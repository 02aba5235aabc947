//! The host: what scripts may call.

use std::sync::Arc;

/// The library of functions that scripts see: Tusche's own, and what a Rust user registers (DESIGN section 4.5).
#[derive(Clone, Default)]
pub struct Host {
    packages: Vec<Arc<dyn Fn(&mut rhai::Engine) + Send + Sync>>,
}

impl Host {
    /// A host with Tusche's own library.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The same host with more functions: `register` is called on every engine that is made (one per thread).
    #[must_use]
    pub fn with(mut self, register: impl Fn(&mut rhai::Engine) + Send + Sync + 'static) -> Self {
        self.packages.push(Arc::new(register));
        self
    }
}
