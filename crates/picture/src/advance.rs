//! Upper bounds of the widths of letters: the larger of the advance widths in DejaVu Sans and in Liberation Sans (with the widths of Arial and Helvetica),
//! in thousandths of the font size.
//!
//! The font of a viewer is unknown when a picture is made. DejaVu Sans is among the widest common fonts, so text that fits with these widths fits with
//! other common fonts.

/// Returns an upper bound of the width of a letter \[font sizes\].
pub(crate) fn advance(letter: char) -> f64 {
    let code = u32::from(letter);
    let within = |table: &[u16], first: u32| code.checked_sub(first).and_then(|place| table.get(usize::try_from(place).ok()?).copied());
    let stored = within(&LATIN, 0x20).or_else(|| within(&LATIN_1, 0xa0)).or_else(|| within(&GREEK, 0x391));
    let thousandths = stored.unwrap_or(match code {
        // Subscripts, superscripts and combining marks.
        0x2070..=0x209c => 540,
        0x300..=0x36f => 600,
        0x2018..=0x201d | 0x2010..=0x2013 => 640,
        // The per ten thousand sign is the widest general punctuation.
        0x2031 => 1740,
        0x2030 => 1350,
        0x2200..=0x22ff => 900,
        // The scripts from Armenian to Ethiopic have letters of nearly 1.5 font sizes.
        0x100..=0x10ff => 1430,
        0x2000..=0x2bff => 1100,
        // Ideographs have width 1, pictographs up to 1.3, and some Arabic ligatures are whole phrases.
        0xfdfa..=0xfdfd => 12_000,
        _ => 1450,
    });
    f64::from(thousandths) / 1000.0
}

/// Widths of U+0020 to U+007E, in thousandths of the size of the font.
const LATIN: [u16; 95] = [
    318, 401, 460, 838, 637, 951, 780, 275, 391, 391, 500, 838, 318, 361, 318, 337, 637, 637, 637, 637, 637, 637, 637, 637, 637, 637, 337, 337, 838,
    838, 838, 557, 1016, 685, 687, 723, 771, 667, 611, 778, 752, 295, 500, 667, 558, 863, 749, 788, 667, 788, 723, 667, 611, 732, 685, 989, 686, 667,
    686, 391, 337, 391, 838, 557, 500, 613, 635, 550, 635, 616, 353, 635, 634, 278, 278, 580, 278, 975, 634, 612, 635, 635, 412, 521, 393, 634, 592,
    818, 592, 592, 525, 637, 337, 637, 838,
];

/// Widths of U+00A0 to U+00FF, in thousandths of the size of the font.
const LATIN_1: [u16; 96] = [
    318, 401, 637, 637, 637, 637, 337, 557, 500, 1000, 472, 612, 838, 361, 1000, 553, 500, 838, 401, 401, 500, 637, 637, 318, 500, 401, 472, 612,
    970, 970, 970, 611, 685, 685, 685, 685, 685, 685, 1000, 723, 667, 667, 667, 667, 295, 295, 295, 295, 775, 749, 788, 788, 788, 788, 788, 838, 788,
    732, 732, 732, 732, 667, 667, 630, 613, 613, 613, 613, 613, 613, 982, 550, 616, 616, 616, 616, 278, 278, 278, 278, 612, 634, 612, 612, 612, 612,
    612, 838, 612, 634, 634, 634, 634, 592, 635, 592,
];

/// Widths of U+0391 to U+03C9, in thousandths of the size of the font.
const GREEK: [u16; 57] = [
    685, 687, 558, 685, 667, 686, 752, 788, 295, 667, 685, 863, 749, 650, 788, 752, 667, 1000, 632, 611, 667, 798, 686, 836, 765, 295, 667, 660, 541,
    634, 339, 579, 660, 639, 592, 612, 541, 544, 634, 612, 339, 590, 592, 637, 559, 558, 612, 690, 635, 587, 634, 603, 579, 660, 578, 713, 838,
];
