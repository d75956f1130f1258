use std::vec::Vec;

use super::outgoing::separation_us;
use super::*;

type Host = IsoTp<64, 4095>;
type Node = IsoTp<2048, 64>;

fn message(length: usize) -> Vec<u8> {
    (0..length).map(|place| (place * 7 + 1) as u8).collect()
}

/// Lets both ends talk until they fall silent; `drop` decides which payload (counted from 0) never arrives.
fn exchange(
    host: &mut Host,
    node: &mut Node,
    drop: impl Fn(usize) -> bool,
) -> (usize, Option<Vec<u8>>, Option<TransferError>) {
    let (mut count, mut whole, mut broken) = (0, None, None);
    let mut arrives = || {
        count += 1;
        !drop(count - 1)
    };
    for time_us in 0.. {
        let mut quiet = true;
        while let Some(payload) = host.poll(time_us) {
            quiet = false;
            if arrives() {
                match node.receive(time_us, &payload) {
                    Progress::Complete => whole = Some(node.message().to_vec()),
                    Progress::Broken(error) => broken = Some(error),
                    Progress::None => {}
                }
            }
        }
        while let Some(payload) = node.poll(time_us) {
            quiet = false;
            if arrives() {
                host.receive(time_us, &payload);
            }
        }
        if quiet {
            break;
        }
    }
    (count, whole, broken)
}

#[test]
fn messages_of_every_length_arrive_whole() {
    for length in 1..=2048 {
        let (mut host, mut node) = (Host::new(), Node::new());
        host.send(0, &message(length)).unwrap();
        let (_, whole, broken) = exchange(&mut host, &mut node, |_| false);
        assert_eq!((whole, broken), (Some(message(length)), None), "{length} bytes");
        assert!(!host.is_sending());
    }
}

#[test]
fn bytes_of_frames_are_those_of_iso_15765_2() {
    let mut host = Host::new();
    host.send(0, &[1, 2, 3]).unwrap();
    assert_eq!(host.poll(0), Some([3, 1, 2, 3, 0xcc, 0xcc, 0xcc, 0xcc]));
    host.send(0, &message(0x123)).unwrap();
    assert_eq!(host.poll(0).unwrap()[..3], [0x11, 0x23, 1]);
    assert_eq!(host.poll(0), None, "waits for flow control");
    host.receive(0, &[0x30, 0, 0]);
    assert_eq!(host.poll(0).unwrap()[0], 0x21);
    let mut node = Node::new();
    node.receive(0, &[0x10, 20, 1, 2, 3, 4, 5, 6]);
    assert_eq!(node.poll(0).unwrap()[..3], [0x30, BLOCK_SIZE, 0]);
}

#[test]
fn message_cut_at_any_frame_is_lost_and_next_arrives() {
    let frames = exchange_all(&message(100), |_| false).0;
    for lost in 0..frames {
        let (mut host, mut node) = (Host::new(), Node::new());
        host.send(0, &message(100)).unwrap();
        let (_, whole, _) = exchange(&mut host, &mut node, |frame| frame == lost);
        // a lost flow control or data frame stops the message; only the last flow control cannot be missed
        assert!(whole.is_none() || whole == Some(message(100)), "frame {lost}");
        assert!(whole.is_none(), "frame {lost} is needed");
        let later = 2 * TIMEOUT_US;
        let _ = (host.check_time(later), node.check_time(later));
        assert!(!host.is_sending(), "gave up after frame {lost}");
        host.send(later, &message(50)).unwrap();
        let (_, whole, _) = exchange(&mut host, &mut node, |_| false);
        assert_eq!(whole, Some(message(50)));
    }
}

fn exchange_all(bytes: &[u8], drop: impl Fn(usize) -> bool) -> (usize, Option<Vec<u8>>) {
    let (mut host, mut node) = (Host::new(), Node::new());
    host.send(0, bytes).unwrap();
    let (count, whole, _) = exchange(&mut host, &mut node, drop);
    (count, whole)
}

#[test]
fn missing_or_duplicate_consecutive_frame_breaks_message() {
    for numbers in [[1, 3], [2, 3]] {
        let mut node = Node::new();
        node.receive(0, &[0x10, 30, 1, 2, 3, 4, 5, 6]);
        let progress = numbers.map(|number| node.receive(0, &[0x20 | number, 0, 0, 0, 0, 0, 0, 0]));
        assert!(progress.contains(&Progress::Broken(TransferError::Sequence)), "{numbers:?}");
        assert!(node.message().is_empty());
    }
    let mut node = Node::new();
    node.receive(0, &[0x10, 30, 1, 2, 3, 4, 5, 6]);
    node.receive(0, &[0x21, 0, 0, 0, 0, 0, 0, 0]);
    let other = node.receive(0, &[0x21, 0, 0, 0, 0, 0, 0, 1]);
    assert_eq!(other, Progress::Broken(TransferError::Sequence));
}

#[test]
fn repeated_first_frame_is_answered_and_another_interrupts() {
    let mut node = Node::new();
    let first = [0x10, 30, 1, 2, 3, 4, 5, 6];
    for time_us in [0, TIMEOUT_US] {
        assert_eq!(node.receive(time_us, &first), Progress::None);
        assert_eq!(node.poll(time_us).unwrap()[..2], [0x30, BLOCK_SIZE]);
    }
    let other = node.receive(TIMEOUT_US, &[0x10, 30, 1, 2, 3, 4, 5, 7]);
    assert_eq!(other, Progress::Broken(TransferError::Interrupted));
}

#[test]
fn a_message_of_which_every_frame_comes_twice_arrives_once() {
    for length in 1..=60 {
        let (mut host, mut node) = (Host::new(), Node::new());
        host.send(0, &message(length)).unwrap();
        let mut whole = 0;
        for time_us in 0..20 {
            while let Some(payload) = host.poll(time_us) {
                let both = [(); 2].map(|()| node.receive(time_us, &payload));
                assert!(!both.iter().any(|p| matches!(p, Progress::Broken(_))), "{length}: {both:?}");
                whole += usize::from(both.contains(&Progress::Complete));
            }
            while let Some(payload) = node.poll(time_us) {
                let _ = [(); 2].map(|()| host.receive(time_us, &payload));
            }
        }
        assert_eq!((whole, node.message()), (1, message(length).as_slice()), "{length}");
    }
}

#[test]
fn a_message_longer_than_the_buffer_is_refused_by_flow_control() {
    let (mut host, mut node) = (Host::new(), Node::new());
    host.send(0, &message(2049)).unwrap();
    let first = host.poll(0).unwrap();
    assert_eq!(node.receive(0, &first), Progress::Broken(TransferError::Length));
    let refusal = node.poll(0).unwrap();
    assert_eq!(refusal[0], 0x32);
    assert_eq!(host.receive(0, &refusal), Progress::Broken(TransferError::Length));
    assert!(!host.is_sending());
    assert_eq!(host.send(0, &message(4096)), Err(TransferError::Length));
    assert_eq!(host.send(0, &[]), Err(TransferError::Length));
}

#[test]
fn separation_time_block_size_and_wait_of_the_receiver_are_kept() {
    let mut host = Host::new();
    host.send(0, &message(100)).unwrap();
    host.poll(0).unwrap();
    host.receive(0, &[0x31, 0, 0]);
    assert_eq!(host.poll(0), None);
    host.receive(0, &[0x30, 2, 5]);
    assert!(host.poll(0).is_some());
    assert_eq!(host.poll(4999), None, "5 ms");
    assert!(host.poll(5000).is_some());
    assert_eq!(host.poll(20_000), None, "a block of two");
    host.receive(20_000, &[0x30, 0, 0xf3]);
    assert!(host.poll(20_000).is_some());
    assert_eq!((host.poll(20_299), host.poll(20_300).is_some()), (None, true), "300 µs");
    for code in [0x80, 0xf0, 0xfa, 0xff] {
        assert_eq!(separation_us(code), 127_000, "reserved values mean the longest");
    }
}

#[test]
fn a_receiver_that_only_waits_is_given_up() {
    let mut host = Host::new();
    host.send(0, &message(100)).unwrap();
    host.poll(0).unwrap();
    let last = (0..=MAX_WAITS).map(|_| host.receive(0, &[0x31, 0, 0])).last();
    assert_eq!(last, Some(Progress::Broken(TransferError::FlowControl)));
    assert!(!host.is_sending());
}

#[test]
fn an_end_that_falls_silent_is_given_up_after_a_second() {
    let (mut host, mut node) = (Host::new(), Node::new());
    host.send(0, &message(100)).unwrap();
    let first = host.poll(0).unwrap();
    node.receive(0, &first);
    assert_eq!((host.check_time(TIMEOUT_US), node.check_time(TIMEOUT_US)), (Ok(()), Ok(())));
    let late = TIMEOUT_US + 1;
    assert_eq!(host.check_time(late), Err(TransferError::Timeout));
    assert_eq!(node.check_time(late), Err(TransferError::Timeout));
    assert_eq!((host.check_time(late), node.check_time(late)), (Ok(()), Ok(())), "said once");
}

#[test]
fn a_second_message_begins_only_after_the_first_has_ended() {
    let mut host = Host::new();
    host.send(0, &message(100)).unwrap();
    assert_eq!(host.send(0, &message(5)), Err(TransferError::Busy));
    let mut node = Node::new();
    node.receive(0, &[0x10, 30, 1, 2, 3, 4, 5, 6]);
    let again = node.receive(0, &[0x10, 8, 1, 2, 3, 4, 5, 6]);
    assert_eq!(again, Progress::Broken(TransferError::Interrupted));
    assert_eq!(node.receive(0, &[0x21, 7, 8]), Progress::Complete, "the later one counts");
    assert_eq!(node.message(), [1, 2, 3, 4, 5, 6, 7, 8]);
}

#[test]
fn arbitrary_payloads_never_exceed_the_buffer() {
    let mut random = crate::testing::Random::new(77);
    let mut node = IsoTp::<40, 40>::new();
    for time_us in 0..200_000 {
        let payload = core::array::from_fn::<u8, 8, _>(|_| ((random.signed() + 1.0) * 128.0) as u8);
        let length = usize::from(payload[7] % 9);
        node.receive(time_us, &payload[..length]);
        node.poll(time_us);
        assert!(node.message().len() <= 40);
    }
}
