//! One client's episode, and what is kept so that it can go back.

use std::{
    collections::VecDeque,
    sync::atomic::{AtomicBool, Ordering},
};

use rmpv::Value;

use super::{
    catalog::ServerConfig,
    live_episode::LiveEpisode,
    request::{Request, Row},
    response,
    state::State,
};
use crate::robot::Side;

/// Episodes that are kept for going back to, besides the one that runs.
const KEPT: usize = 4;

/// One client's episode.
pub(super) struct Session<'a> {
    offer: &'a ServerConfig<'a>,
    stop: &'a AtomicBool,
    running: Option<LiveEpisode>,
    /// Copies of where episodes stood, the one used last at the end.
    kept: VecDeque<LiveEpisode>,
}

impl<'a> Session<'a> {
    /// No episode yet; `stop` ends what takes long.
    pub(super) fn new(offer: &'a ServerConfig<'a>, stop: &'a AtomicBool) -> Self {
        Self { offer, stop, running: None, kept: VecDeque::new() }
    }

    /// Gives up the episode: nobody knows in which state it is.
    pub(super) fn forget(&mut self) {
        self.running = None;
    }

    /// Carries out a request; after an error the episode stands where it stood.
    ///
    /// # Errors
    /// Why it cannot be carried out; a message for people.
    pub(super) fn answer(&mut self, request: Request) -> Result<Value, String> {
        match request {
            Request::Reset(wanted) => {
                self.go_to(&State { wanted, actions: Vec::new() })?;
                self.stands("reset")
            }
            Request::SetState(state) => {
                self.go_to(&state)?;
                self.stands("set_state")
            }
            Request::Step(rows) => self.step(&rows),
            Request::Render { camera, size } => self.render(camera, size),
            Request::GetState => self.get_state(),
            Request::Close => Ok(response::plain("close", Vec::new())),
        }
    }

    fn running(&mut self, kind: &str) -> Result<&mut LiveEpisode, String> {
        self.running.as_mut().ok_or_else(|| format!("{kind}: there is no episode yet; reset first"))
    }

    /// What a client is told when it comes to a state other than by steps.
    fn stands(&mut self, kind: &str) -> Result<Value, String> {
        let offer = self.offer;
        response::stands(kind, self.running(kind)?, offer, None)
    }

    /// Brings the episode to a state: from where one stood on the way to it, if there is such a one, or from its start.
    fn go_to(&mut self, state: &State) -> Result<(), String> {
        let all = self.kept.iter().chain(&self.running);
        let near = all.filter_map(|one| Some((one.state.left_to(state)?, one)));
        let mut running = match near.min_by_key(|(left, _)| *left) {
            Some((_, one)) => one.clone(),
            None => {
                let start = State { actions: Vec::new(), ..state.clone() };
                let running = LiveEpisode::start(self.offer, start)?;
                self.keep(running.clone());
                running
            }
        };
        for row in &state.actions[running.state.actions.len()..] {
            self.check_stop()?;
            running.advance(self.offer, row)?;
        }
        let (done, all) = (running.state.actions.len(), state.actions.len());
        if done < all {
            return Err(format!("set_state: the episode ends after {done} of the state's {all} actions"));
        }
        self.running = Some(running);
        Ok(())
    }

    /// Keeps a copy of where an episode stands, instead of one that was not used for long.
    fn keep(&mut self, copy: LiveEpisode) {
        self.kept.retain(|one| one.state != copy.state);
        if self.kept.len() == KEPT {
            self.kept.pop_front();
        }
        self.kept.push_back(copy);
    }

    fn step(&mut self, rows: &[Row]) -> Result<Value, String> {
        let offer = self.offer;
        if self.running("step")?.episode.outcome().is_some() {
            return Err("step: the episode is over; reset first".to_owned());
        }
        let mut carried_out = 0;
        for row in rows {
            self.check_stop()?;
            let running = self.running("step")?;
            running.advance(offer, row)?;
            carried_out += 1;
            if running.episode.outcome().is_some() {
                break;
            }
        }
        response::stands("step", self.running("step")?, offer, Some(carried_out))
    }

    fn render(&mut self, camera: Option<String>, size: [Option<usize>; 2]) -> Result<Value, String> {
        let running = self.running("render")?;
        let cameras = &running.episode.sim.scene.cameras;
        let camera = camera.or_else(|| cameras.first().map(|camera| camera.name.clone())).unwrap_or_default();
        let finger = match camera.as_str() {
            name if cameras.iter().any(|camera| camera.name == name) => None,
            "left" => Some(Side::Left),
            "right" => Some(Side::Right),
            _ => None,
        };
        let picture = match finger {
            Some(_) if size != [None, None] => {
                return Err(format!("render: {camera}: pictures of the fingers have one size; give none"));
            }
            Some(side) => running.episode.render_tactile(side),
            None => running.episode.render_camera(&camera, size),
        };
        let picture = picture.map_err(|e| format!("render: {e}"))?;
        Ok(response::plain("render", vec![response::pair("image", response::picture(picture))]))
    }

    fn get_state(&mut self) -> Result<Value, String> {
        let copy = self.running("get_state")?.clone();
        let state = copy.state.to_value(self.offer);
        self.keep(copy);
        Ok(response::plain("get_state", vec![response::pair("state", state)]))
    }

    fn check_stop(&self) -> Result<(), String> {
        match self.stop.load(Ordering::Relaxed) {
            true => Err("the server is ending".to_owned()),
            false => Ok(()),
        }
    }
}
