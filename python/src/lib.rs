//! Scenes, runs, links and stability for Python: the private module that the package `cohaptic` stands on.
//!
//! Everything is computed on a thread of its own with the interpreter released, so that other threads of Python go on and Ctrl-C is heard.

mod admittance;
mod arrays;
mod campaign;
mod campaign_table;
mod drawing;
mod errors;
mod family;
mod fit;
mod interrupt;
mod law;
mod link;
mod record;
mod run;
mod scene;
mod stability;
mod table;

#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::admittance::admittance_of;
    #[pymodule_export]
    use crate::campaign::{Campaign, CampaignAnswer};
    #[pymodule_export]
    use crate::drawing::Drawing;
    #[pymodule_export]
    use crate::family::{boundary_of, map_of};
    #[pymodule_export]
    use crate::fit::Delays;
    #[pymodule_export]
    use crate::law::{Held, State};
    #[pymodule_export]
    use crate::link::{Link, causes, is_profile, profile};
    #[pymodule_export]
    use crate::run::Run;
    #[pymodule_export]
    use crate::scene::Scene;
    #[pymodule_export]
    use crate::stability::{eigenvalues_of, monodromy_of, stability};
    #[pymodule_export]
    use crate::table::Table;
}
