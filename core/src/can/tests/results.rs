use super::*;

fn result(sequence: u16, planes: usize) -> MonitorResult {
    let mut unbalance_g_mm = [[0.0; 2]; MAX_PLANES];
    for (place, plane) in unbalance_g_mm.iter_mut().take(planes).enumerate() {
        *plane = [1.0 + place as f32, -2.0];
    }
    MonitorResult {
        sequence,
        flags: FLAG_FLAGGED | flag_at_bound(1),
        suspect: Some(1),
        redundancy: 4,
        streak: 4,
        used_mask: 0b1110,
        reason: Reason::Rise,
        planes: planes as u8,
        unbalance_g_mm,
        static_g_mm: [4.0, 6.0],
        dynamic_g_mm: [-1.0, -1.0],
        e_um: 12.0,
        ratio: 0.25,
        floor_um: 3.0,
        level_um: 5.0,
    }
}

#[test]
fn result_of_any_plane_count_needs_all_its_frames() {
    for planes in 1..=MAX_PLANES {
        let mut assembler = ResultAssembler::new();
        let sent = result_frames(NODE, &result(8, planes));
        assert_eq!(sent.len(), planes + 6);
        let got: Vec<_> = sent.iter().filter_map(|frame| assembler.receive(frame)).collect();
        assert_eq!(got, [result(8, planes)]);
        for place in 0..sent.len() {
            let mut assembler = ResultAssembler::new();
            let cut = without(sent.iter().copied().collect(), place);
            let next = result_frames(NODE, &result(9, planes));
            let got: Vec<_> = cut.iter().chain(&next).filter_map(|frame| assembler.receive(frame)).collect();
            assert_eq!(got, [result(9, planes)], "frame {place} of {planes} planes lost");
            assert_eq!(assembler.damaged(), u16::from(place != 0));
        }
    }
}

#[test]
fn a_result_whose_plane_was_swapped_for_another_is_damaged() {
    let mut sent: Vec<_> = result_frames(NODE, &result(8, 2)).into_iter().collect();
    sent[2] = Message::Unbalance { plane: 3, unbalance_g_mm: [2.0, -2.0] }.encode(NODE);
    let mut assembler = ResultAssembler::new();
    assert!(sent.iter().all(|frame| assembler.receive(frame).is_none()));
    assert_eq!(assembler.damaged(), 1);
}
