//! How stiff may the force be that keeps three copies of a cube together, over which delay? A map of stability, drawn with letters.
//!
//! The example shows the analysis without any simulation: a scene in TOML with two open keys is a family, and each cell of the map is the largest
//! eigenvalue of one frame of its motion. Below 1 every disturbance dies out.
//!
//! ```text
//! cargo run -p cohaptic-stability --example how_stiff
//! ```
#![allow(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use cohaptic_stability::{Family, Grid, KeyRange, Map};

const SCENE: &str = r#"
    scene = { duration = "1s", count = 3 }
    object = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 500.0, damping = 5.0, update = "8ms" }
    peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    link = { delay = "8ms" }
"#;

/// Returns the map of a strategy over the delay of the links and the stiffness of the coordination.
fn map(strategy: &str) -> Result<Map, Box<dyn Error>> {
    let overrides = [format!("coordination.strategy={strategy}")];
    let keys = vec![KeyRange::parse("link.delay=0ms..60ms")?, KeyRange::parse("coordination.stiffness=100..3000")?];
    let family = Family::new(SCENE, Path::new("three.toml"), &overrides, keys)?;
    Ok(Map::fill(&family, Grid::new(61, 16)?, |_| (), || false)?)
}

/// Returns the maps of the README.
fn maps() -> Result<String, Box<dyn Error>> {
    let mut text = String::from("Stable where nothing is drawn, unstable at #\n");
    for strategy in ["average-position", "proportional-derivative"] {
        let map = map(strategy)?;
        writeln!(text, "\nKT [N/m], {strategy}")?;
        for (stiffness, radii) in map.y.iter().zip(&map.radius).rev() {
            let cells: String = radii.iter().map(|radius| if *radius < 1.0 { ' ' } else { '#' }).collect();
            writeln!(text, "{stiffness:>8.0} |{cells}|")?;
        }
        writeln!(text, "{:>9} 0{:>60} delay [ms]", "", 60)?;
    }
    Ok(text)
}

fn main() -> Result<(), Box<dyn Error>> {
    print!("{}", maps()?);
    Ok(())
}

#[test]
fn the_readme_shows_the_maps() -> Result<(), Box<dyn Error>> {
    assert!(include_str!("../README.md").contains(&maps()?), "{}", maps()?);
    Ok(())
}
