use std::vec::Vec;

use super::*;

const KEY: Key = Key([0x5a; KEY_BYTES]);

fn request(command: Command, counter: u64, body: &[u8]) -> Vec<u8> {
    let mut buffer = [0; 128];
    let length = write_request(&mut buffer, &KEY, 3, command, counter, body).unwrap();
    buffer[..length].to_vec()
}

#[test]
fn bytes_of_a_request_are_the_documented_ones_and_its_code_is_hmac_sha_256() {
    let bytes = request(Command::Deploy, 0x0102_0304_0506_0708, b"model");
    assert_eq!(bytes[..12], [1, 1, 3, 0, 8, 7, 6, 5, 4, 3, 2, 1]);
    assert_eq!(bytes[12..17], *b"model");
    // python: hmac.new(b"\x5a" * 32, bytes.fromhex("0101030008070605040302016d6f64656c"), "sha256").hexdigest()[:32]
    let code =
        [0xcb, 0x31, 0x18, 0x00, 0x31, 0x6b, 0xc1, 0x5f, 0x07, 0x57, 0x13, 0x99, 0x53, 0x98, 0xbe, 0xb2];
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
fn a_wrong_key_no_key_another_node_and_an_old_counter_are_told_apart() {
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
    let code = KEY.code([signed, &[]]);
    bytes[HEAD_BYTES..].copy_from_slice(&code);
    assert_eq!(open_request(&bytes, Some(&KEY), 3, 0), Err(Outcome::Malformed));
}

#[test]
fn an_answer_comes_back_and_belongs_to_its_request_alone() {
    let (one, other) = (request(Command::Deploy, 7, b"a"), request(Command::Deploy, 8, b"a"));
    for outcome in Outcome::ALL {
        let answer = Answer {
            node: 3,
            command: 1,
            outcome,
            counter: 7,
            model_checksum: 0xdead_beef,
            model_error: Some(ModelError::IllConditioned),
        };
        let bytes = answer.encode(&one, Some(&KEY));
        assert_eq!(Answer::decode(&bytes, &one, &KEY), Some((answer, true)));
        assert_eq!(Answer::decode(&bytes, &other, &KEY), Some((answer, false)), "another request");
        assert_eq!(Answer::decode(&bytes, &one, &Key([0; 32])), Some((answer, false)), "another key");
        assert_eq!(Answer::decode(&answer.encode(&one, None), &one, &KEY), Some((answer, false)));
        assert_eq!(Answer::decode(&bytes[..20], &one, &KEY), None);
    }
}

#[test]
fn numbers_on_the_wire_stay_what_they_are() {
    let outcomes = Outcome::ALL.map(|outcome| outcome as u8);
    assert_eq!(outcomes, [0, 1, 2, 3, 4, 5, 6]);
    assert_eq!([Command::Deploy as u8, Command::Restart as u8], [1, 2]);
    for code in 1..=13 {
        assert_eq!(ModelError::from_code(code).map(|error| error as u8), Some(code));
    }
    assert_eq!((ModelError::from_code(0), ModelError::from_code(14)), (None, None));
}

#[test]
fn a_key_never_shows_in_debug_output() {
    assert_eq!(std::format!("{KEY:?}"), "Key");
}
