//! Axes of Haply and axes of a scene.
//!
//! Haply counts X to the right of the user, Y forward and Z up (documentation of the Inverse Service 3.5). A scene counts x to the right of the user, y up
//! and z towards the user.

/// Three components: of a position \[m\], a velocity \[m/s\] or a force \[N\].
pub type Triple = [f64; 3];

/// Returns a vector of Haply's axes in the axes of a scene.
#[must_use]
pub const fn to_scene([x, y, z]: Triple) -> Triple {
    [x, z, -y]
}

/// Returns a vector of the axes of a scene in Haply's axes.
#[must_use]
pub const fn to_haply([x, y, z]: Triple) -> Triple {
    [x, -z, y]
}

/// Returns the Euclidean length of a vector, in the unit of the vector.
#[must_use]
pub(crate) fn length([x, y, z]: Triple) -> f64 {
    libm::hypot(libm::hypot(x, y), z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_goes_out_along_the_axes_of_haply() {
        assert_eq!(to_haply([1.0, 2.0, 3.0]), [1.0, -3.0, 2.0]);
        assert_eq!(to_scene(to_haply([1.0, 2.0, 3.0])), [1.0, 2.0, 3.0]);
    }
}
