//! The end of the service: nothing that was sent in time is lost.
#![cfg(unix)]

use crate::load::{Client, Process, get};
use crate::support::Server;

/// The process stands still while requests and the signal arrive, so that it finds all of them at
/// once.
#[test]
fn requests_that_arrive_together_with_the_signal_are_answered() {
    for _ in 0..5 {
        let mut server = Server::start();
        let process = Process(server.child.id());
        let open = || Client::open(&server.address).unwrap();
        let kept: Vec<Client> = (0..20)
            .map(|_| open())
            .map(|mut client| client.ask(&get("/livez")).map(|_| client).unwrap())
            .collect();
        process.signal("STOP");
        let mut clients: Vec<Client> = kept.into_iter().chain((0..20).map(|_| open())).collect();
        clients.iter_mut().for_each(|client| client.send(&get("/livez")).unwrap());
        process.signal("TERM");
        process.signal("CONT");
        for (i, client) in clients.iter_mut().enumerate() {
            let reply = client.receive().unwrap_or_else(|error| panic!("connection {i}: {error}"));
            assert_eq!(reply.status, 200, "connection {i}");
        }
        drop(clients);
        assert!(server.child.wait().unwrap().success());
    }
}
