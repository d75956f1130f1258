//! The machine drawn to scale from its file: shaft, couplings, disks, bearings, probes, planes.

use maud::{Markup, html};

use rotor_edge_desktop::machine::drawing::{Coupling, Disk, Rotor};

/// Width that the drawing is made for, a phone's, so that its text is as large as the text around it.
const WIDTH_PX: f64 = 400.0;
const TEXT_PX: f64 = 12.5;
const SIDE_PX: f64 = 14.0;
const ROW_PX: f64 = 17.0;
/// Least distance of a name from the side of the drawing.
const NAME_MARGIN_PX: f64 = 2.0;
/// Highest that the machine is drawn; one with large disks is drawn smaller.
const TALLEST_PX: f64 = 220.0;
/// A disk of no width is still seen.
const THINNEST_PX: f64 = 3.0;
const BEARING_PX: f64 = 12.0;
/// What is marked stands in a ring of this radius.
const MARK_PX: f64 = 9.0;

/// A place of the machine that the page speaks of.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Along the shaft, m.
    pub position_m: f64,
    /// What is said of it.
    pub text: String,
    /// Whether it is what the page is about; others are faint.
    pub is_main: bool,
}

/// Radius and width, m, of a uniform solid disk of these inertias; a disk without inertia has neither.
fn disk_size_m(d: &Disk) -> [f64; 2] {
    if d.mass_kg <= 0.0 || d.polar_inertia_kg_m2 <= 0.0 {
        return [0.0, 0.0];
    }
    // Ip = m r²/2, Id = m r²/4 + m h²/12
    let radius2 = 2.0 * d.polar_inertia_kg_m2 / d.mass_kg;
    let width2 = 12.0 * (d.diametral_inertia_kg_m2 / d.mass_kg - 0.25 * radius2);
    [radius2.sqrt(), width2.max(0.0).sqrt()]
}

/// A name beside the machine, in a row in which it does not meet another.
struct Name {
    at_px: f64,
    text: String,
    is_main: bool,
    row: usize,
    width_px: f64,
}

impl Name {
    /// A name that is wider than the drawing is pressed into its width.
    fn written(&self, y_px: f64) -> Markup {
        let class = self.is_main.then_some("main");
        let widest_px = WIDTH_PX - 2.0 * NAME_MARGIN_PX;
        let pressed = (self.width_px > widest_px).then_some(widest_px);
        html! {
            text class=[class] x=(place(self.at_px)) y=(place(y_px)) text-anchor="middle" dominant-baseline="central"
                textLength=[pressed] lengthAdjust=[pressed.map(|_| "spacingAndGlyphs")] {
                (self.text)
            }
        }
    }
}

/// How wide a text is at most in a reader's font, px: as in the widest usual ones, Verdana and DejaVu Sans.
fn text_width_px(text: &str) -> f64 {
    let width_em = |c: char| match c {
        'f' | 'i' | 'j' | 'l' | 't' | ' ' | '.' | ',' | ':' | ';' | '\'' | '|' | '/' => 0.40,
        'r' | 'I' | 's' | '(' | ')' | '-' | '°' | '·' => 0.55,
        'm' | 'w' | 'M' | 'W' | '%' | '–' => 1.08,
        'A'..='Z' | '−' | '+' | '=' | '<' | '>' => 0.84,
        _ => 0.65,
    };
    TEXT_PX * text.chars().map(width_em).sum::<f64>()
}

/// Names by place, each in the first row in which it does not meet another.
fn rows(names: &[(f64, String, bool)]) -> Vec<Name> {
    let mut sorted: Vec<_> = names.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut ends: Vec<f64> = Vec::new();
    let mut placed = Vec::new();
    for (at, text, is_main) in sorted {
        let width_px = text_width_px(&text) * if is_main { 1.1 } else { 1.0 };
        let half = 0.5 * width_px;
        let margin = (half + NAME_MARGIN_PX).min(0.5 * WIDTH_PX);
        let at_px = at.clamp(margin, WIDTH_PX - margin);
        let row = ends.iter().position(|end| at_px - half > end + 4.0).unwrap_or(ends.len());
        if row == ends.len() {
            ends.push(0.0);
        }
        ends[row] = at_px + half;
        placed.push(Name { at_px, text, is_main, row, width_px });
    }
    placed
}

/// How a machine is laid on the drawing.
#[derive(Debug, Clone, Copy)]
struct DrawingScale {
    left_m: f64,
    /// px of a metre.
    per_m: f64,
    /// Where the leftmost part begins, px.
    first_px: f64,
    /// Largest radius, m.
    tallest_m: f64,
}

impl DrawingScale {
    /// `sizes` are radius and width of the disks, m.
    fn of(rotor: &Rotor, sizes: &[[f64; 2]]) -> Self {
        let ends =
            |(d, [_, width]): (&Disk, &[f64; 2])| [d.position_m - 0.5 * width, d.position_m + 0.5 * width];
        let (mut left, mut right) = (0.0_f64, rotor.length_m());
        for [a, b] in rotor.disk.iter().zip(sizes).map(ends) {
            (left, right) = (left.min(a), right.max(b));
        }
        let shaft_m = rotor.shaft.iter().map(|s| 0.5 * s.outer_diameter_m).fold(0.0, f64::max);
        let tallest_m = sizes.iter().map(|s| s[0]).fold(shaft_m, f64::max);
        let per_m = ((WIDTH_PX - 2.0 * SIDE_PX) / (right - left)).min(0.5 * TALLEST_PX / tallest_m);
        Self { left_m: left, per_m, first_px: 0.5 * (WIDTH_PX - per_m * (right - left)), tallest_m }
    }

    fn x_px(self, z_m: f64) -> f64 {
        self.first_px + self.per_m * (z_m - self.left_m)
    }
}

/// Where a place of the shaft, m from its left end, is on the drawing, as a share of its width.
pub fn across(rotor: &Rotor, position_m: f64) -> f64 {
    let sizes: Vec<[f64; 2]> = rotor.disk.iter().map(disk_size_m).collect();
    DrawingScale::of(rotor, &sizes).x_px(position_m) / WIDTH_PX
}

/// Draws a machine with its marks; lengths and diameters in one scale.
pub fn sketch(title: &str, rotor: &Rotor, marks: &[Mark]) -> Markup {
    let sizes: Vec<[f64; 2]> = rotor.disk.iter().map(disk_size_m).collect();
    let scale = DrawingScale::of(rotor, &sizes);
    let DrawingScale { per_m, tallest_m, .. } = scale;
    let x = |z: f64| scale.x_px(z);
    let half_px = (per_m * tallest_m).max(30.0);
    let planes = rotor.plane.iter().map(|p| (x(p.position_m), format!("plane {}", p.name), false));
    let marked = marks.iter().map(|m| (x(m.position_m), m.text.clone(), m.is_main));
    let above = rows(&planes.chain(marked).collect::<Vec<_>>());
    let mut named: Vec<(f64, String, bool)> =
        rotor.bearing.iter().map(|b| (x(b.position_m), format!("▲ {}", b.name), false)).collect();
    named.extend(rotor.coupling.iter().map(|c| (x(c.position_m), c.name.clone(), false)));
    named.extend(rotor.disk.iter().map(|d| (x(d.position_m), d.name.clone(), false)));
    named.extend(probe_places(rotor).into_iter().map(|(z, names)| (x(z), format!("↑ {names}"), false)));
    let below = rows(&named);
    let rows_of = |all: &[Name]| all.iter().map(|r| r.row + 1).max().unwrap_or(0) as f64 * ROW_PX;
    let axis_px = rows_of(&above) + 8.0 + half_px;
    let under_px = axis_px + half_px + BEARING_PX + 8.0;
    let height_px = under_px + rows_of(&below) + 24.0;
    let radius_px = |z: f64| 0.5 * per_m * diameter_m(rotor, z);
    let mut from_m = 0.0;
    let pieces = rotor.shaft.iter().map(|s| {
        let at = x(from_m);
        from_m += s.length_m;
        (at, per_m * s.length_m, [s.outer_diameter_m, s.inner_diameter_m].map(|d| per_m * d))
    });
    html! {
        svg class="sketch" viewBox={ "0 0 " (WIDTH_PX) " " (place(height_px)) } role="img" aria-label=(title) {
            title { (title) }
            @for p in &rotor.plane {
                (stroke("plane", [[x(p.position_m), rows_of(&above) + 2.0], [x(p.position_m), under_px - 6.0]]))
            }
            @for (d, [radius, width]) in rotor.disk.iter().zip(&sizes) {
                @let half = [0.5 * (per_m * width).max(THINNEST_PX), (per_m * radius).max(THINNEST_PX)];
                (boxed("disk", [x(d.position_m) - half[0], axis_px - half[1]], half.map(|h| 2.0 * h)))
            }
            @for (at, length, [outer, bore]) in pieces {
                (boxed("shaft", [at, axis_px - 0.5 * outer], [length, outer]))
                @if bore > 0.0 { (boxed("bore", [at, axis_px - 0.5 * bore], [length, bore])) }
            }
            @for c in &rotor.coupling { (coupling([x(c.position_m), axis_px], 0.75 * per_m * diameter_m(rotor, c.position_m), c)) }
            @for b in &rotor.bearing { (triangle([x(b.position_m), axis_px + radius_px(b.position_m)])) }
            @for (z, _) in probe_places(rotor) { (probe([x(z), axis_px - radius_px(z)])) }
            @for m in marks {
                @let class = if m.is_main { "mark main" } else { "mark" };
                circle class=(class) cx=(place(x(m.position_m))) cy=(place(axis_px)) r=(MARK_PX) {}
            }
            @for name in &above { (name.written(ROW_PX * (name.row as f64 + 0.5))) }
            @for name in &below { (name.written(under_px + ROW_PX * (name.row as f64 + 0.5))) }
            (ruler(per_m, under_px + rows_of(&below) + 10.0))
        }
    }
}

/// Two flanges of this height above the axis, apart where the coupling gives.
fn coupling([at, axis]: [f64; 2], half_px: f64, coupling: &Coupling) -> Markup {
    const FLANGE_PX: f64 = 3.0;
    let gap = if coupling.flexibility.is_some() { 2.0 } else { 0.0 };
    let size = [FLANGE_PX, 2.0 * half_px.max(FLANGE_PX)];
    html! {
        @for left in [at - gap - FLANGE_PX, at + gap] { (boxed("flange", [left, axis - 0.5 * size[1]], size)) }
    }
}

fn probe_places(rotor: &Rotor) -> Vec<(f64, String)> {
    let mut places: Vec<(f64, String)> = Vec::new();
    for p in &rotor.probe {
        match places.iter_mut().find(|(z, _)| (*z - p.position_m).abs() < 1e-6) {
            Some((_, names)) => *names += &format!(", {}", p.name),
            None => places.push((p.position_m, p.name.clone())),
        }
    }
    places
}

fn diameter_m(rotor: &Rotor, position_m: f64) -> f64 {
    let mut end = 0.0;
    let here = rotor.shaft.iter().find(|s| {
        end += s.length_m;
        position_m <= end
    });
    here.or(rotor.shaft.last()).map_or(0.0, |s| s.outer_diameter_m)
}

/// A coordinate as it is written.
fn place(px: f64) -> String {
    format!("{px:.1}")
}

fn boxed(class: &str, corner_px: [f64; 2], size_px: [f64; 2]) -> Markup {
    let [x, y] = corner_px.map(place);
    let [width, height] = size_px.map(place);
    html! { rect class=(class) x=(x) y=(y) width=(width) height=(height) {} }
}

fn stroke(class: &str, [from, to]: [[f64; 2]; 2]) -> Markup {
    let [[x1, y1], [x2, y2]] = [from, to].map(|end| end.map(place));
    html! { line class=(class) x1=(x1) y1=(y1) x2=(x2) y2=(y2) {} }
}

/// A bearing under the shaft.
fn triangle([at, top]: [f64; 2]) -> Markup {
    let foot = [-0.6, 0.6].map(|side| format!(" {:.1},{:.1}", at + side * BEARING_PX, top + BEARING_PX));
    html! { polygon class="bearing" points={ (place(at)) "," (place(top)) (foot[0]) (foot[1]) } {} }
}

/// An arrow towards the shaft.
fn probe([at, top]: [f64; 2]) -> Markup {
    let tip = [at, top - 2.0];
    html! {
        (stroke("probe", [tip, [at, top - 16.0]]))
        (stroke("probe", [tip, [at - 3.5, top - 7.0]]))
        (stroke("probe", [tip, [at + 3.5, top - 7.0]]))
    }
}

/// A bar of a round length, with its length.
fn ruler(per_m: f64, at_px: f64) -> Markup {
    let longest_m = 0.4 * WIDTH_PX / per_m;
    let decade = 10_f64.powf(longest_m.log10().floor());
    let length_m =
        [5.0, 2.0, 1.0].into_iter().map(|s| s * decade).find(|l| *l <= longest_m).unwrap_or(decade);
    let end = SIDE_PX + per_m * length_m;
    let text = if length_m < 0.1 { format!("{:.0} mm", length_m * 1e3) } else { format!("{length_m} m") };
    html! {
        (stroke("ruler", [[SIDE_PX, at_px], [end, at_px]]))
        text x=(place(end + 6.0)) y=(place(at_px)) dominant-baseline="central" { (text) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disk_is_drawn_with_size_of_its_inertias() {
        let (mass_kg, radius, width) = (18.0, 0.2, 0.07);
        let d = Disk {
            name: "d".into(),
            position_m: 0.0,
            mass_kg,
            diametral_inertia_kg_m2: mass_kg * (3.0 * radius * radius + width * width) / 12.0,
            polar_inertia_kg_m2: mass_kg * radius * radius / 2.0,
        };
        let [r, w] = disk_size_m(&d);
        assert!((r - radius).abs() < 1e-12 && (w - width).abs() < 1e-12);
    }

    #[test]
    fn name_wider_than_the_drawing_is_pressed_into_it() {
        for (letters, is_main) in [(38, false), (40, false), (40, true), (500, true)] {
            let placed = rows(&[(20.0, "W".repeat(letters), is_main)]);
            assert_eq!(placed[0].at_px, 0.5 * WIDTH_PX, "{letters}");
            assert!(placed[0].written(0.0).into_string().contains("textLength=\"396\""), "{letters}");
        }
        let short = rows(&[(20.0, "W".repeat(4), false)]);
        assert!(!short[0].written(0.0).into_string().contains("textLength"));
    }

    #[test]
    fn names_that_would_meet_stand_in_different_rows() {
        let names = [(100.0, "bearing one"), (110.0, "bearing two"), (300.0, "far")];
        let names = names.map(|(at, name)| (at, name.to_string(), false));
        let placed: Vec<usize> = rows(&names).iter().map(|r| r.row).collect();
        assert_eq!(placed, [0, 1, 0]);
    }
}
