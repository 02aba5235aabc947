//! Typed indices into the tables of a [`Scene`](super::Scene). Their `Display` is their spelling in messages and dumps.

use std::fmt;

macro_rules! id {
    ($(#[$doc:meta])* $name:ident, $prefix:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub u32);

        impl $name {
            /// The id of the entry at a table index.
            ///
            /// # Panics
            /// Above 2³² − 1 entries, which no table reaches: each entry takes more than four bytes.
            #[must_use]
            pub fn from_index(index: usize) -> Self {
                Self(u32::try_from(index).expect("tables hold fewer than 2^32 entries"))
            }

            /// The index into its table.
            #[must_use]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, concat!($prefix, "{}"), self.0)
            }
        }
    };
}

id!(/// A mesh of the scene.
    MeshId, "mesh");
id!(/// A material of the scene: a script with its parameters.
    MaterialId, "mat");
id!(/// A script of the scene.
    ScriptId, "script");
id!(/// A texture of the scene.
    TextureId, "tex");
id!(/// An object of the scene: a mesh with a place and materials.
    ObjectId, "object");
