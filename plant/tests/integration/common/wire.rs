//! A wire between two servers that can be cut.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

pub struct Wire {
    pub port: u16,
    is_cut: Arc<AtomicBool>,
    ends: Arc<Mutex<Vec<TcpStream>>>,
}

impl Wire {
    /// To whoever listens at a port of this machine.
    pub fn to(port: u16) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let wire = Self {
            port: listener.local_addr().unwrap().port(),
            is_cut: Arc::default(),
            ends: Arc::default(),
        };
        let (is_cut, ends) = (Arc::clone(&wire.is_cut), Arc::clone(&wire.ends));
        std::thread::spawn(move || {
            for near in listener.incoming() {
                let (Ok(near), false) = (near, is_cut.load(Ordering::Relaxed)) else { continue };
                let Ok(far) = TcpStream::connect(("127.0.0.1", port)) else { continue };
                let both = [
                    (near.try_clone().unwrap(), far.try_clone().unwrap()),
                    (far.try_clone().unwrap(), near.try_clone().unwrap()),
                ];
                both.into_iter().for_each(|(from, to)| drop(std::thread::spawn(|| carry(from, to))));
                ends.lock().unwrap().extend([near, far]);
            }
        });
        wire
    }

    pub fn cut(&self) {
        self.is_cut.store(true, Ordering::Relaxed);
        self.ends.lock().unwrap().drain(..).for_each(|end| drop(end.shutdown(Shutdown::Both)));
    }

    pub fn mend(&self) {
        self.is_cut.store(false, Ordering::Relaxed);
    }
}

fn carry(mut from: TcpStream, mut to: TcpStream) {
    let mut some = vec![0; 65_536];
    while let Ok(length @ 1..) = from.read(&mut some) {
        if to.write_all(&some[..length]).is_err() {
            break;
        }
    }
    for end in [from, to] {
        // it may be shut already
        let _ = end.shutdown(Shutdown::Both);
    }
}
