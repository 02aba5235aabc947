//! When two samples differ (DESIGN section 3.1).

use bitflags::bitflags;

bitflags! {
    /// Which tests found a difference.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct Fired: u8 {
        /// Object ids differ.
        const OBJECT = 1;
        /// Materials differ.
        const SHADER = 2;
        /// Texture coordinates differ.
        const UV = 4;
        /// Normals differ.
        const NORMAL = 8;
        /// Feature colours differ.
        const FEATURE = 16;
        /// One side is a miss (set beside `OBJECT` or `SHADER`).
        const MISS = 32;
    }
}
