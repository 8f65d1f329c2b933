//! The inequality of contacts. The norm measures states and depths. The products are (a) to (d) of [`super`], and equal contacts share their multipliers.

use super::contact_frame::ContactFrame;
use crate::inequality::{Inequality, Measured, Part, Product, Row};

/// A group of equal contacts, one per member of a class of equal peers.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Group {
    /// Number of ticks in a frame.
    pub(super) ticks: usize,
    /// Number of peers of the class.
    pub(super) members: f64,
    pub(super) is_wall: bool,
    /// `true` if depths are measured from a rest with the contact open.
    pub(super) has_rest: bool,
}

/// The frame of a part, with the group of each of its contacts.
#[derive(Clone, Copy, Debug)]
pub(super) struct PartFrame<'a> {
    pub(super) frame: &'a ContactFrame,
    /// Index of the group of each contact of the frame.
    pub(super) groups: &'a [usize],
    /// `true` for the differences of equal peers.
    pub(super) is_apart: bool,
}

/// Number of products, and so of multipliers, of one tick of a contact.
const PRODUCTS: usize = 7;

/// The rows of a contact at one tick, as indices among the rows of the part. Let f be the force divided by the stiffness, p = max(0, depth), v the velocity of
/// the depth times B/K, and b = p − depth.
struct Tick {
    /// Row of the force divided by the stiffness, f.
    force: usize,
    /// Row of the positive part of the depth, p.
    pressed: usize,
    /// Row of p at the next tick.
    pressed_next: usize,
    /// Row of f − p − v, zero in contact.
    rest: usize,
    /// Row of the change of b to the next tick.
    opening: usize,
    /// Row of depth − p. Held as a row and not as an index, because only some products need this row.
    inside: Row,
}

/// Returns the inequality of the parts, or `None` if a row of a part depends on the position of a loose device.
pub(super) fn inequality(parts: &[PartFrame<'_>], groups: &[Group]) -> Option<Inequality> {
    let mut multipliers = Multipliers { first: Vec::new(), shared: Vec::new(), free: Vec::new(), groups };
    for group in groups {
        multipliers.first.push(multipliers.free.len());
        // Only product (a) is an equality, f·(f − p − v) = 0, so only its multiplier, the first of a tick, may have either sign.
        let free = (0..group.ticks * PRODUCTS).map(|number| number % PRODUCTS == 0);
        multipliers.free.extend(free);
    }
    // Copies with common walls have products with each other. A group of one copy has no products with itself; a group with a rest has products with the rest
    // instead.
    for (one, first) in groups.iter().enumerate() {
        for (other, second) in groups.iter().enumerate() {
            if first.is_wall && second.is_wall && !first.has_rest && (one != other || first.members > 1.0) {
                multipliers.shared.push((one, other, multipliers.free.len()));
                multipliers.free.extend(std::iter::repeat_n(false, 2 * first.ticks.min(second.ticks)));
            }
        }
    }
    let parts = parts.iter().enumerate().map(|(shape, part)| part_of(part, shape, &multipliers)).collect::<Option<Vec<_>>>()?;
    let shapes = parts.iter().map(|part| part.before.rows.len()).collect();
    Some(Inequality { shapes, parts, free: multipliers.free })
}

/// The places of the multipliers of groups.
struct Multipliers<'a> {
    groups: &'a [Group],
    /// Index of the first multiplier of each group.
    first: Vec<usize>,
    /// Pairs of groups of walls: the group of copy i, the group of copy j, and the index of the pair's first multiplier.
    shared: Vec<(usize, usize, usize)>,
    /// `true` if a multiplier may be below zero, indexed by multiplier: true only for (a).
    free: Vec<bool>,
}

/// Returns the inequality of one part. The unknowns are the states but the loose states, the forces, and the p of each contact at each tick and at the next
/// frame's first tick. `None` if a row depends on a loose state.
fn part_of(part: &PartFrame<'_>, shape: usize, multipliers: &Multipliers<'_>) -> Option<Part> {
    let frame = part.frame;
    let states: Vec<usize> = (0..frame.next.rows()).filter(|row| !frame.loose.contains(row)).collect();
    let columns: Vec<usize> = states.iter().copied().chain(frame.next.rows()..frame.next.columns()).collect();
    let unknowns = columns.len() + frame.contacts.iter().map(|contact| contact.depths.len()).sum::<usize>();
    let unit = |place: usize| Row { entries: (0..unknowns).map(|other| f64::from(u8::from(other == place))).collect(), error: 0.0 };
    // Leaves the loose states out of a row. This is exact only if their coefficients are zero.
    let taken = |row: &[f64], error: f64| -> Option<Row> {
        let entries = columns.iter().map(|column| row[*column]).chain(std::iter::repeat_n(0.0, unknowns - columns.len())).collect();
        frame.loose.iter().all(|loose| row[*loose] == 0.0).then_some(Row { entries, error })
    };
    let mut rows = Vec::new();
    let mut put = |row: Row| {
        rows.push(row);
        rows.len() - 1
    };
    let (mut before, mut after) = (Vec::new(), Vec::new());
    for (place, state) in states.iter().enumerate() {
        before.push(put(unit(place)));
        after.push(put(taken(frame.next.row(*state), frame.error)?));
    }
    let mut ticks: Vec<Vec<Tick>> = Vec::new();
    let mut first = columns.len();
    for contact in &frame.contacts {
        let count = contact.rates.len();
        let pressed: Vec<usize> = (first..=first + count).map(|place| put(unit(place))).collect();
        // The norm measures the depth p at the beginning of the frame and, in the same place, at the beginning of the next frame.
        before.push(pressed[0]);
        after.push(pressed[count]);
        let mut own = Vec::with_capacity(count);
        for tick in 0..count {
            let force = contact.first - frame.next.rows() + states.len() + tick;
            let mut rest = taken(&contact.rates[tick].iter().map(|rate| -rate).collect::<Vec<_>>(), frame.error)?;
            rest.entries[force] += 1.0;
            rest.entries[first + tick] -= 1.0;
            // The position of a loose device cancels in the difference of two depths.
            let deeper: Vec<f64> = contact.depths[tick].iter().zip(&contact.depths[tick + 1]).map(|(depth, next)| depth - next).collect();
            let mut opening = taken(&deeper, 4.0 * frame.error)?;
            // b = p − depth, so b of the next tick less b of this tick is p_next − p − (depth_next − depth).
            opening.entries[first + tick] -= 1.0;
            opening.entries[first + tick + 1] += 1.0;
            // Without the check for loose states: groups with a rest and walls, the only users of this row, have no loose state.
            let mut inside = Row { entries: columns.iter().map(|column| contact.depths[tick][*column]).collect(), error: 2.0 * frame.error };
            inside.entries.resize(unknowns, 0.0);
            inside.entries[first + tick] -= 1.0;
            let (rest, opening) = (put(rest), put(opening));
            own.push(Tick { force: put(unit(force)), pressed: pressed[tick], pressed_next: pressed[tick + 1], rest, opening, inside });
        }
        ticks.push(own);
        first += count + 1;
    }
    let mut products = Vec::new();
    for (own, group) in ticks.iter().zip(part.groups) {
        // A sum over n equal peers is n times the product of the averages, plus the products of the differences, which have the weight 1.
        let weight = if part.is_apart { 1.0 } else { multipliers.groups[*group].members };
        for (number, tick) in own.iter().enumerate() {
            let multiplier = multipliers.first[*group] + number * PRODUCTS;
            let mut add = |place: usize, factors: [usize; 2], weight: f64| products.push(Product { factors, multiplier: multiplier + place, weight });
            add(0, [tick.force, tick.rest], weight);
            add(1, [tick.pressed, tick.rest], weight);
            add(2, [tick.force, tick.opening], weight);
            add(3, [tick.pressed, tick.opening], weight);
            // The last product holds with the opposite sign: see (d) of the module head.
            add(4, [tick.pressed_next, tick.opening], -weight);
            if multipliers.groups[*group].has_rest {
                let inside = put(tick.inside.clone());
                add(5, [tick.pressed, inside], weight);
                add(6, [tick.force, inside], weight);
            }
        }
    }
    // Copies that share walls: p_i·(b_j − b_i) summed over all i of one group and j of another.
    let place = |group: usize| part.groups.iter().position(|own| *own == group);
    for (one, other, start) in &multipliers.shared {
        let Some(first) = place(*one) else { continue };
        let (weight, second) = if part.is_apart { (1.0, None) } else { (multipliers.groups[*one].members, place(*other)) };
        // Within one group the averages cancel in b_j − b_i; only the differences have this product.
        if !part.is_apart && one == other {
            continue;
        }
        // Copies with different numbers of ticks have no common instants beyond the smaller number.
        let count = multipliers.groups[*one].ticks.min(multipliers.groups[*other].ticks);
        for (tick, own) in ticks[first].iter().take(count).enumerate() {
            let mut row = own.inside.clone();
            if let Some(second) = second {
                let inside = &ticks[second][tick].inside;
                row.entries.iter_mut().zip(&inside.entries).for_each(|(entry, inside)| *entry -= inside);
                row.error += inside.error;
            }
            let row = put(row);
            products.push(Product { factors: [own.pressed, row], multiplier: start + 2 * tick, weight });
            products.push(Product { factors: [own.force, row], multiplier: start + 2 * tick + 1, weight });
        }
    }
    let of = |rows| Measured { shape, rows };
    Some(Part { rows, before: of(before), after: of(after), products, unknowns })
}
