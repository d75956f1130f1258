//! Who a NATS server lets in, and whom it lets a gateway speak for: passwords, seeds, certificates, permissions.

use std::path::Path;

use crate::common::nats::Nats;
use crate::common::{Bus, Program, refusal, run, until};
use rcgen::{BasicConstraints, CertificateParams, IsCa, Issuer, KeyPair};
use rotor_edge_plant::item::Kind;
use rotor_edge_plant::store::Store;

#[test]
fn wrong_password_is_distinct_from_absent_server_and_hidden() {
    let Some(nats) = Nats::start_with("authorization { user: gateway, password: s3cret }\n", "") else {
        return;
    };
    let bus = Bus::start();
    let spec = bus.spec();
    let said = refusal(&["gateway", "--bus", &spec, "--to", &nats.address()]);
    assert!(said.contains("authorization"), "{said}");
    let wrong = format!("nats://gateway:wr0ng@127.0.0.1:{}", nats.port);
    let said = refusal(&["gateway", "--bus", &spec, "--to", &wrong]);
    assert!(said.contains("authorization") && !said.contains("wr0ng"), "{said}");
    let said = refusal(&["gateway", "--bus", &spec, "--to", &nats.address(), "--credentials", "none.creds"]);
    assert!(said.contains("none.creds: cannot be read"), "{said}");
    let right = format!("nats://gateway:s3cret@127.0.0.1:{}", nats.port);
    let gateway = Program::start(&["gateway", "--bus", &spec, "--to", &right]).listening();
    let (code, _, err) = gateway.end();
    assert_eq!((code, err.contains("s3cret")), (Some(0), false), "{err}");
}

/// Certificate and key of a server at this machine, and the certificate of who signed it.
fn certified(folder: &Path) -> [String; 3] {
    let mut authority = CertificateParams::new([]).unwrap();
    authority.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    let [signing, own] = [(); 2].map(|()| KeyPair::generate().unwrap());
    let signed_itself = authority.self_signed(&signing).unwrap().pem();
    let of_server = CertificateParams::new(["127.0.0.1".to_string()]).unwrap();
    let certificate = of_server.signed_by(&own, &Issuer::new(authority, signing)).unwrap().pem();
    let files = [("server.pem", certificate), ("server.key", own.serialize_pem()), ("ca.pem", signed_itself)];
    files.map(|(name, text)| {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    })
}

#[test]
fn connection_is_encrypted_only_with_right_certificate() {
    let folders = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let [[certificate, key, authority], [.., other]] =
        folders.each_ref().map(|folder| certified(folder.path()));
    let settings = format!("tls {{ cert_file: {certificate:?}, key_file: {key:?} }}\n");
    let Some(nats) = Nats::start_with(&settings, "") else { return };
    let store = folders[0].path().join("plant.db").display().to_string();
    let mut bus = Bus::start();
    let spec = bus.spec();
    let encrypted = format!("tls://127.0.0.1:{}", nats.port);
    let to = |address: &str, authority: &str| {
        ["gateway", "--bus", &spec, "--to", address, "--ca", authority].map(String::from)
    };
    for words in [to(&encrypted, &other), to(&nats.address(), &other)] {
        let said = refusal(&words.each_ref().map(String::as_str));
        assert!(said.contains("no NATS server with JetStream that lets us in"), "{said}");
    }
    // this system knows nobody who signed it
    assert!(refusal(&["gateway", "--bus", &spec, "--to", &encrypted]).contains("no NATS server"));
    assert!(
        refusal(&to(&encrypted, &key).each_ref().map(String::as_str))
            .contains("expected certificates in PEM")
    );
    let plain = Nats::start().unwrap();
    let said = refusal(&to(&plain.address(), &authority).each_ref().map(String::as_str));
    assert!(
        said.contains("no NATS server"),
        "whoever states a certificate wants no plain connection: {said}"
    );

    let gateway = Program::start(&to(&encrypted, &authority).each_ref().map(String::as_str)).listening();
    let collect = ["collect", "--from", &encrypted, "--ca", &authority, "--store", &store];
    let collection = Program::start(&collect).listening();
    bus.say(1, 0);
    until("the reading", || {
        Store::open(Path::new(&store)).is_ok_and(|s| s.count(Kind::Result).unwrap() == 1)
    });
    for program in [gateway, collection] {
        assert_eq!(program.end().0, Some(0));
    }
}

/// What docs/plant-at-scale.md says of a gateway that may speak for its own bus alone, for two programs with seeds of their own.
fn permissions(public: [&str; 2]) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/plant-at-scale.md");
    let page = std::fs::read_to_string(path).unwrap();
    let (_, rest) = page.split_once("```\nauthorization").unwrap();
    let mut text = format!("authorization{}", rest.split_once("```").unwrap().0);
    for (example, key) in ["UHALL3", "UCOLLECT"].into_iter().zip(public) {
        assert!(text.contains(example));
        text = text.replace(example, key);
    }
    text
}

/// The file of a new seed, and its public key as it is printed.
fn seed(folder: &Path, name: &str) -> (String, String) {
    let path = folder.join(name).display().to_string();
    let said = String::from_utf8(run(&["nkey", "-o", &path]).stdout).unwrap();
    let (_, public) = said.split_once("nkey: ").unwrap();
    (path, public.trim().into())
}

#[test]
fn gateway_may_speak_only_for_its_bus_with_page_permissions() {
    let folder = tempfile::tempdir().unwrap();
    let (mine, public) = seed(folder.path(), "hall3.seed");
    let (theirs, public_of_collection) = seed(folder.path(), "collect.seed");
    let Some(nats) = Nats::start_with(&permissions([&public, &public_of_collection]), "") else { return };
    let store = folder.path().join("plant.db").display().to_string();
    let mut bus = Bus::start();
    let address = nats.address();
    let words = |name: &str, seed: &str| {
        let named = format!("{name}={}", bus.spec());
        ["gateway", "--plant", "north", "--bus", &named, "--to", &address, "--credentials", seed]
            .map(String::from)
    };
    let hall4 = words("hall4", &mine);
    let said = refusal(&hall4.each_ref().map(String::as_str));
    assert!(said.contains("lets nobody with these credentials speak for bus hall4 of north"), "{said}");
    let (stranger, _) = seed(folder.path(), "stranger.seed");
    let said = refusal(&words("hall3", &stranger).each_ref().map(String::as_str));
    assert!(said.contains("authorization"), "{said}");
    let hall3 = words("hall3", &mine);
    let gateway = Program::start(&hall3.each_ref().map(String::as_str)).listening();
    bus.say(1, 0);
    let collector =
        Program::start(&["collect", "--from", &address, "--credentials", &theirs, "--store", &store]);
    until("the reading", || {
        Store::open(Path::new(&store)).is_ok_and(|s| s.count(Kind::Result).unwrap() == 1)
    });
    assert_eq!(collector.end().0, Some(0));
    // the last numbers are asked for
    assert_eq!(gateway.end().0, Some(0));
    let gateway = Program::start(&hall3.each_ref().map(String::as_str)).listening();
    assert_eq!(gateway.end().0, Some(0));
    assert!(refusal(&["nkey", "-o", &mine]).contains("cannot be written"), "an old seed is kept");
}
