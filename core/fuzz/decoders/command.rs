//! Requests, answers, thresholds.

use rotor_edge_core::command::{
    Answer, Command, HEAD_BYTES, Key, MAX_COUNTER_STEP, Outcome, Request, open_request, write_request,
};
use rotor_edge_core::thresholds::Thresholds;

use super::Bytes;

/// The key of every device here.
pub const KEY: Key = Key([0x52; 32]);
/// The number of every node here.
pub const NODE: u8 = 3;

/// One of the commands there are.
pub fn any_command(byte: u8) -> Command {
    match byte % 7 {
        0 => Command::Deploy,
        1 => Command::Restart,
        2 => Command::Acknowledge,
        3 => Command::SetThresholds,
        4 => Command::GetThresholds,
        5 => Command::DeployAnother,
        _ => Command::Trial,
    }
}

/// Bytes that nobody signed are not a request; what was signed comes back, once, and with any byte changed it does not.
pub fn request(bytes: &[u8]) {
    assert!(open_request(bytes, Some(&KEY), NODE, 0).is_err());
    let mut bytes = Bytes(bytes);
    let command = any_command(bytes.u8());
    let (counter, last) = (u64::from_le_bytes(bytes.array()), u64::from_le_bytes(bytes.array()));
    let (at, change) = (usize::from(bytes.u16()), bytes.u8());
    let body = bytes.0;
    let mut buffer = vec![0; HEAD_BYTES + body.len() + 16];
    let length = write_request(&mut buffer, &KEY, NODE, command, counter, body).expect("there is room");
    assert_eq!(length, buffer.len());
    let expected = match counter.checked_sub(last) {
        None | Some(0) => Err(Outcome::Replayed),
        Some(step) if step > MAX_COUNTER_STEP => Err(Outcome::Counter),
        Some(_) => Ok(Request { command, counter, body }),
    };
    assert_eq!(open_request(&buffer, Some(&KEY), NODE, last), expected);
    assert_eq!(open_request(&buffer, None, NODE, last), Err(Outcome::NoKey));
    assert_eq!(open_request(&buffer, Some(&KEY), NODE + 1, last), Err(Outcome::Forged));
    buffer[at % length] ^= change.max(1);
    assert!(matches!(
        open_request(&buffer, Some(&KEY), NODE, last),
        Err(Outcome::Forged | Outcome::Malformed)
    ));
}

/// An answer that is read is the same after being written again, and is confirmed then; as it came, it is not.
pub fn answer(bytes: &[u8]) {
    let (request, bytes) = bytes.split_at(bytes.len().min(30));
    let Some((answer, confirmed)) = Answer::decode(bytes, request, &KEY) else { return };
    assert!(!confirmed);
    let written = answer.encode(request, Some(&KEY));
    let (again, confirmed) = Answer::decode(&written, request, &KEY).expect("it was written here");
    assert!(confirmed);
    // the counter is kept from whom it does not concern
    assert_eq!(format!("{again:?}"), format!("{:?}", Answer { counter: again.counter, ..answer }));
    assert!(again.counter == answer.counter || again.counter == 0);
}

/// Thresholds that are read are in their bounds and have these bytes alone.
pub fn thresholds(bytes: &[u8]) {
    if let Ok(thresholds) = Thresholds::decode(bytes) {
        assert_eq!(thresholds.check(), Ok(()));
        assert_eq!(thresholds.encode(), bytes);
    }
}
