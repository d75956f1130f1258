use std::vec::Vec;

use super::*;

const KEY: Key = Key([0x5a; KEY_BYTES]);

fn request(command: Command, counter: u64, body: &[u8]) -> Vec<u8> {
    let mut buffer = [0; 128];
    let length = write_request(&mut buffer, &KEY, 3, command, counter, body).unwrap();
    buffer[..length].to_vec()
}

#[test]
fn request_bytes_are_documented_and_code_is_hmac_sha_256() {
    let bytes = request(Command::Deploy, 0x0102_0304_0506_0708, b"model");
    assert_eq!(bytes[..12], [2, 1, 3, 0, 8, 7, 6, 5, 4, 3, 2, 1]);
    assert_eq!(bytes[12..17], *b"model");
    // python: hmac.new(b"\x5a" * 32, b"rotor-edge request" + bytes.fromhex("0201030008070605040302016d6f64656c"),
    //                  "sha256").hexdigest()[:32]
    let code =
        [0xd8, 0x6e, 0x8b, 0xb1, 0x5a, 0xd5, 0x7b, 0x84, 0x88, 0x71, 0x61, 0x53, 0x02, 0xf1, 0x58, 0x5b];
    assert_eq!(bytes[17..], code);
}

#[test]
fn every_flipped_bit_and_every_cut_of_a_request_is_refused() {
    let good = request(Command::Deploy, 7, b"body");
    assert!(open_request(&good, Some(&KEY), 3, 6).is_ok());
    for bit in 0..good.len() * 8 {
        let mut bad = good.clone();
        bad[bit / 8] ^= 1 << (bit % 8);
        let refused = open_request(&bad, Some(&KEY), 3, 6);
        assert!(matches!(refused, Err(Outcome::Forged | Outcome::Malformed)), "bit {bit}: {refused:?}");
    }
    for length in 0..good.len() {
        assert!(open_request(&good[..length], Some(&KEY), 3, 6).is_err(), "{length} bytes");
    }
}

#[test]
fn wrong_key_no_key_other_node_and_old_counter_are_distinct() {
    let good = request(Command::Deploy, 7, b"body");
    let outcome =
        |key: Option<Key>, node, last| open_request(&good, key.as_ref(), node, last).map(|r| r.counter);
    assert_eq!(outcome(Some(KEY), 3, 6), Ok(7));
    assert_eq!(outcome(Some(Key([1; 32])), 3, 6), Err(Outcome::Forged));
    assert_eq!(outcome(None, 3, 6), Err(Outcome::NoKey));
    assert_eq!(outcome(Some(KEY), 4, 6), Err(Outcome::Forged));
    assert_eq!(outcome(Some(KEY), 3, 7), Err(Outcome::Replayed));
    assert_eq!(
        outcome(Some(Key([1; 32])), 3, 7),
        Err(Outcome::Forged),
        "the counter is nobody else's business"
    );
}

#[test]
fn an_unknown_command_with_the_right_code_is_malformed() {
    let mut bytes = request(Command::Deploy, 7, b"");
    bytes[1] = 9;
    let (signed, _) = bytes.split_at(HEAD_BYTES);
    let code = KEY.code([REQUEST_DOMAIN, signed, &[]]);
    bytes[HEAD_BYTES..].copy_from_slice(&code);
    assert_eq!(open_request(&bytes, Some(&KEY), 3, 0), Err(Outcome::Malformed));
}

fn answer(outcome: Outcome) -> Answer {
    let detail = match outcome {
        Outcome::Model => Detail::Model { error: ModelError::Probes, asked: 8, held: 4 },
        Outcome::Thresholds => Detail::Thresholds(ThresholdError::Growth),
        _ => Detail::None,
    };
    let thresholds = (outcome == Outcome::Accepted).then_some(Thresholds::DEFAULT);
    Answer { node: 3, command: 1, outcome, counter: 7, model_checksum: 0xdead_beef, detail, thresholds }
}

#[test]
fn an_answer_comes_back_and_belongs_to_its_request_alone() {
    let (one, other) = (request(Command::Deploy, 7, b"a"), request(Command::Deploy, 8, b"a"));
    for outcome in Outcome::ALL {
        let answer = Answer { counter: if outcome.tells_counter() { 7 } else { 0 }, ..answer(outcome) };
        let bytes = answer.encode(&one, Some(&KEY));
        assert_eq!(Answer::decode(&bytes, &one, &KEY), Some((answer, true)));
        assert_eq!(Answer::decode(&bytes, &other, &KEY), Some((answer, false)), "another request");
        assert_eq!(Answer::decode(&bytes, &one, &Key([0; 32])), Some((answer, false)), "another key");
        assert_eq!(Answer::decode(&answer.encode(&one, None), &one, &KEY), Some((answer, false)));
        assert_eq!(Answer::decode(&bytes[..20], &one, &KEY), None);
    }
}

#[test]
fn detail_of_accepted_model_comes_back_and_unknown_is_none() {
    let request = request(Command::Deploy, 7, b"a");
    let replaced = |lowered, suspect| Detail::Replaced { lowered, suspect };
    for (detail, bytes) in [
        (Detail::None, [0, 0, 0]),
        (Detail::Unchanged, [1, 0, 0]),
        (replaced(Reason::None, None), [2, 0, 0]),
        (replaced(Reason::Jump, Some(6)), [2, 13, 7]),
        (replaced(Reason::Unknown(200), None), [2, 200, 0]),
    ] {
        let answer = Answer { detail, thresholds: None, ..answer(Outcome::Accepted) };
        let encoded = answer.encode(&request, Some(&KEY));
        assert_eq!(encoded[16..19], bytes);
        assert_eq!(Answer::decode(&encoded, &request, &KEY), Some((answer, true)));
        // a client of before took no detail from an accepted answer, and ours takes none that it does not know
        let mut newer = encoded.clone();
        newer[16] = 3;
        let read = Answer::decode(&newer, &request, &KEY).unwrap().0;
        assert_eq!((read.outcome, read.detail), (Outcome::Accepted, Detail::None));
    }
}

#[test]
fn the_counter_is_told_to_nobody_without_the_key() {
    let request = request(Command::Deploy, 7, b"a");
    for (outcome, told) in
        [(Outcome::Forged, 0), (Outcome::Malformed, 0), (Outcome::NoKey, 0), (Outcome::Replayed, 7)]
    {
        let bytes = answer(outcome).encode(&request, Some(&KEY));
        assert_eq!(bytes[4..12], u64::to_le_bytes(told), "{outcome:?}");
    }
}

#[test]
fn an_answer_is_no_request_and_a_request_no_answer() {
    // The bytes of an answer with the code of the answers' domain, taken for a request; and the other way round.
    let one = request(Command::Deploy, 7, b"a");
    let bytes = answer(Outcome::Storage).encode(&one, Some(&KEY));
    assert_eq!(open_request(&bytes, Some(&KEY), 3, 0), Err(Outcome::Forged));
    let head = &bytes[..20];
    let code = KEY.code([REQUEST_DOMAIN, head, code_of(&one)]);
    let reflected: Vec<u8> = head.iter().chain(&code).copied().collect();
    assert!(!Answer::decode(&reflected, &one, &KEY).unwrap().1);
}

#[test]
fn no_counter_locks_commands_out() {
    let outcome = |counter, last| {
        open_request(&request(Command::Restart, counter, b""), Some(&KEY), 3, last).map(|r| r.counter)
    };
    assert_eq!(outcome(u64::MAX, 0), Err(Outcome::Counter));
    assert_eq!(outcome(MAX_COUNTER_STEP, 0), Ok(MAX_COUNTER_STEP));
    assert_eq!(outcome(MAX_COUNTER_STEP + 1, 0), Err(Outcome::Counter));
    assert_eq!(outcome(u64::MAX, u64::MAX - 1), Ok(u64::MAX));
    assert_eq!(outcome(5, u64::MAX), Err(Outcome::Replayed));
    // The end is millions of the longest steps away, each with the key.
    assert_eq!(u64::MAX / MAX_COUNTER_STEP, (1 << 22) - 1);
}

#[test]
fn numbers_on_the_wire_stay_what_they_are() {
    let outcomes = Outcome::ALL.map(|outcome| outcome as u8);
    assert_eq!(outcomes, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
    for code in 1..=7 {
        assert_eq!(Command::from_byte(code).map(|command| command as u8), Some(code));
    }
    assert_eq!((Command::from_byte(0), Command::from_byte(8)), (None, None));
}

#[test]
fn a_key_never_shows_in_debug_output() {
    assert_eq!(std::format!("{KEY:?}"), "Key");
}
