//! The machine drawn to scale from its file: shaft, couplings, disks, bearings, probes, planes.

use plotters::prelude::{PathElement, Polygon, Rectangle};
use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, RGBColor};

use rotor_edge_desktop::machine::drawing::{Coupling, Disk, Rotor};

use super::canvas::{
    Drawn, FAINT, GRID, INK, Sheet, WIDTH_PX, anchored, line, model_colour, px, svg, text_width_px, write,
};

const SIDE_PX: f64 = 14.0;
const ROW_PX: f64 = 17.0;
/// Highest that the machine is drawn; one with large disks is drawn smaller.
const TALLEST_PX: f64 = 220.0;
/// A disk of no width is still seen.
const THINNEST_PX: f64 = 3.0;
const BEARING_PX: f64 = 12.0;
const STEEL: RGBColor = RGBColor(205, 212, 218);

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

/// Names under the machine: place, text, and the row in which it does not meet another.
fn rows(names: &[(f64, String)]) -> Vec<(f64, String, usize)> {
    let mut sorted: Vec<_> = names.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut ends: Vec<f64> = Vec::new();
    let mut placed = Vec::new();
    for (at, text) in sorted {
        let half = 0.5 * text_width_px(&text);
        let at = at.clamp(half.min(0.5 * WIDTH_PX) + 2.0, (WIDTH_PX - half - 2.0).max(0.5 * WIDTH_PX));
        let row = ends.iter().position(|end| at - half > end + 4.0).unwrap_or(ends.len());
        if row == ends.len() {
            ends.push(0.0);
        }
        ends[row] = at + half;
        placed.push((at, text, row));
    }
    placed
}

/// Draws a machine; lengths and diameters in one scale.
pub fn sketch(title: &str, rotor: &Rotor) -> String {
    let sizes: Vec<[f64; 2]> = rotor.disk.iter().map(disk_size_m).collect();
    let ends = |(d, [_, width]): (&Disk, &[f64; 2])| [d.position_m - 0.5 * width, d.position_m + 0.5 * width];
    let (mut left, mut right) = (0.0_f64, rotor.length_m());
    for [a, b] in rotor.disk.iter().zip(&sizes).map(ends) {
        (left, right) = (left.min(a), right.max(b));
    }
    let shaft_m = rotor.shaft.iter().map(|s| 0.5 * s.outer_diameter_m).fold(0.0, f64::max);
    let tallest_m = sizes.iter().map(|s| s[0]).fold(shaft_m, f64::max);
    let per_m = ((WIDTH_PX - 2.0 * SIDE_PX) / (right - left)).min(0.5 * TALLEST_PX / tallest_m);
    let middle_px = 0.5 * (WIDTH_PX - per_m * (right - left));
    let x = |z: f64| middle_px + per_m * (z - left);
    let half_px = (per_m * tallest_m).max(30.0);
    let above = rows(&rotor.plane.iter().map(|p| (x(p.position_m), p.name.clone())).collect::<Vec<_>>());
    let mut named: Vec<(f64, String)> =
        rotor.bearing.iter().map(|b| (x(b.position_m), format!("▲ {}", b.name))).collect();
    named.extend(rotor.coupling.iter().map(|c| (x(c.position_m), c.name.clone())));
    named.extend(rotor.disk.iter().map(|d| (x(d.position_m), d.name.clone())));
    named.extend(probe_places(rotor).into_iter().map(|(z, names)| (x(z), format!("↑ {names}"))));
    let below = rows(&named);
    let rows_of =
        |all: &[(f64, String, usize)]| all.iter().map(|r| r.2 + 1).max().unwrap_or(0) as f64 * ROW_PX;
    let axis_px = rows_of(&above) + 8.0 + half_px;
    let under_px = axis_px + half_px + BEARING_PX + 8.0;
    svg(title, under_px + rows_of(&below) + 24.0, |sheet| {
        for p in &rotor.plane {
            dashed(sheet, [x(p.position_m), rows_of(&above) + 2.0], under_px - 6.0)?;
        }
        for (d, [radius, width]) in rotor.disk.iter().zip(&sizes) {
            let half = [0.5 * (per_m * width).max(THINNEST_PX), (per_m * radius).max(THINNEST_PX)];
            boxed(
                sheet,
                [x(d.position_m) - half[0], axis_px - half[1]],
                half.map(|h| 2.0 * h),
                model_colour(0),
            )?;
        }
        let mut from = 0.0;
        for s in &rotor.shaft {
            let outer = per_m * s.outer_diameter_m;
            boxed(sheet, [x(from), axis_px - 0.5 * outer], [per_m * s.length_m, outer], STEEL)?;
            let bore = per_m * s.inner_diameter_m;
            if bore > 0.0 {
                boxed(
                    sheet,
                    [x(from), axis_px - 0.5 * bore],
                    [per_m * s.length_m, bore],
                    RGBColor(255, 255, 255),
                )?;
            }
            from += s.length_m;
        }
        for c in &rotor.coupling {
            coupling(sheet, [x(c.position_m), axis_px], 0.75 * per_m * diameter_m(rotor, c.position_m), c)?;
        }
        let radius_px = |z: f64| 0.5 * per_m * diameter_m(rotor, z);
        for b in &rotor.bearing {
            let (at, top) = (x(b.position_m), axis_px + radius_px(b.position_m));
            let corners = [
                (at, top),
                (at - 0.6 * BEARING_PX, top + BEARING_PX),
                (at + 0.6 * BEARING_PX, top + BEARING_PX),
            ];
            let corners = corners.map(|(a, b)| (px(a), px(b)));
            sheet.draw(&Polygon::new(corners.to_vec(), model_colour(1).filled()))?;
        }
        for (z, _) in probe_places(rotor) {
            let (at, top) = (x(z), axis_px - radius_px(z));
            let path = |ends: [(f64, f64); 2]| {
                PathElement::new(ends.map(|(a, b)| (px(a), px(b))).to_vec(), line(model_colour(2), 1.6))
            };
            sheet.draw(&path([(at, top - 2.0), (at, top - 16.0)]))?;
            sheet.draw(&path([(at, top - 2.0), (at - 3.5, top - 7.0)]))?;
            sheet.draw(&path([(at, top - 2.0), (at + 3.5, top - 7.0)]))?;
        }
        for (at, text, row) in &above {
            write(
                sheet,
                text,
                [*at, ROW_PX * (*row as f64 + 0.5)],
                anchored(INK, HPos::Center, VPos::Center),
            )?;
        }
        for (at, text, row) in &below {
            let down = under_px + ROW_PX * (*row as f64 + 0.5);
            write(sheet, text, [*at, down], anchored(INK, HPos::Center, VPos::Center))?;
        }
        ruler(sheet, per_m, under_px + rows_of(&below) + 10.0)
    })
}

/// Two flanges of this height above the axis, apart where the coupling gives.
fn coupling(sheet: &Sheet, [at, axis]: [f64; 2], half_px: f64, coupling: &Coupling) -> Drawn {
    const FLANGE_PX: f64 = 3.0;
    let gap = if coupling.flexibility.is_some() { 2.0 } else { 0.0 };
    let size = [FLANGE_PX, 2.0 * half_px.max(FLANGE_PX)];
    for left in [at - gap - FLANGE_PX, at + gap] {
        boxed(sheet, [left, axis - 0.5 * size[1]], size, INK)?;
    }
    Ok(())
}

/// Probes by place.
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

fn boxed(sheet: &Sheet, corner_px: [f64; 2], size_px: [f64; 2], colour: RGBColor) -> Drawn {
    let corners = [
        (px(corner_px[0]), px(corner_px[1])),
        (px(corner_px[0] + size_px[0]), px(corner_px[1] + size_px[1])),
    ];
    sheet.draw(&Rectangle::new(corners, colour.mix(0.55).filled()))?;
    Ok(sheet.draw(&Rectangle::new(corners, line(FAINT, 0.8)))?)
}

fn dashed(sheet: &Sheet, [at, from]: [f64; 2], to: f64) -> Drawn {
    let mut y = from;
    while y < to {
        let ends = vec![(px(at), px(y)), (px(at), px((y + 4.0).min(to)))];
        sheet.draw(&PathElement::new(ends, line(FAINT, 1.0)))?;
        y += 8.0;
    }
    Ok(())
}

/// A bar of a round length, with its length.
fn ruler(sheet: &Sheet, per_m: f64, at_px: f64) -> Drawn {
    let longest_m = 0.4 * WIDTH_PX / per_m;
    let decade = 10_f64.powf(longest_m.log10().floor());
    let length_m =
        [5.0, 2.0, 1.0].into_iter().map(|s| s * decade).find(|l| *l <= longest_m).unwrap_or(decade);
    let ends = [(SIDE_PX, at_px), (SIDE_PX + per_m * length_m, at_px)].map(|(a, b)| (px(a), px(b)));
    sheet.draw(&PathElement::new(ends.to_vec(), line(INK, 2.0)))?;
    sheet.draw(&PathElement::new(ends.to_vec(), line(GRID, 0.5)))?;
    let text = if length_m < 0.1 { format!("{:.0} mm", length_m * 1e3) } else { format!("{length_m} m") };
    let beside = [SIDE_PX + per_m * length_m + 6.0, at_px];
    write(sheet, &text, beside, anchored(INK, HPos::Left, VPos::Center))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disk_is_drawn_with_the_radius_and_width_that_its_inertias_state() {
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
    fn names_that_would_meet_stand_in_different_rows() {
        let names = [(100.0, "bearing one".into()), (110.0, "bearing two".into()), (300.0, "far".into())];
        let placed: Vec<usize> = rows(&names).iter().map(|r| r.2).collect();
        assert_eq!(placed, [0, 1, 0]);
    }
}
