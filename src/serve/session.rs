//! One client's episode, and copies of earlier states to return to.

use std::collections::VecDeque;

use rmpv::Value;

use super::{
    attempts::{Attempt, Attempts},
    config::{RequestError, ServerConfig},
    render_budget::{MAX_RENDER_PIXELS, RenderBudget},
    request::Request,
    response::{self, StepResult},
    state::{ActionRow, EpisodeState, LiveEpisode},
};
use softvt_common::cancel::CancelFlag;
use softvt_policy::{encode::image_array, msgpack::pack_array, profile::ObservationSource};
use softvt_robot::Side;

/// Copies of earlier states per client.
const MAX_SNAPSHOTS: usize = 4;

pub(super) struct ClientSession<'a> {
    config: &'a ServerConfig<'a>,
    render_budget: &'a RenderBudget,
    attempts: &'a Attempts<'a>,
    cancel: &'a CancelFlag,
    live: Option<LiveEpisode>,
    /// Copies of earlier states, the most recently used one last.
    snapshots: VecDeque<LiveEpisode>,
    /// The attempt at the episode that will be recorded, if it is one.
    attempt: Option<Attempt<'a>>,
}

impl<'a> ClientSession<'a> {
    /// A session without an episode. Its images wait for `render_budget`; `attempts` are of all clients;
    /// `cancel` interrupts long requests.
    pub(super) fn new(
        config: &'a ServerConfig<'a>,
        render_budget: &'a RenderBudget,
        attempts: &'a Attempts<'a>,
        cancel: &'a CancelFlag,
    ) -> Self {
        let snapshots = VecDeque::new();
        Self { config, render_budget, attempts, cancel, live: None, snapshots, attempt: None }
    }

    /// Discards the episode, whose state may be inconsistent after a panic.
    pub(super) fn discard_episode(&mut self) {
        self.attempt = None;
        self.live = None;
    }

    /// Executes a request and returns the response.
    ///
    /// # Errors
    /// The request cannot be executed. The episode is then unchanged, except for the actions of a step
    /// before the failing one.
    pub(super) fn execute(&mut self, request: Request) -> Result<Value, RequestError> {
        let config = self.config;
        match request {
            Request::Reset(id) => {
                self.go_to(&EpisodeState { id, actions: Vec::new() })?;
                response::transition("reset", self.live("reset")?, config, None)
            }
            Request::SetState(state) => {
                self.go_to(&state)?;
                response::transition("set_state", self.live("set_state")?, config, None)
            }
            Request::Step(rows) => self.step(&rows),
            Request::Render { camera, width, height } => self.render(camera, width, height),
            Request::Cameras => Ok(response::cameras(self.live("cameras")?)),
            Request::GetState => self.get_state(),
            Request::Close => Ok(response::typed("close", [])),
        }
    }

    fn live(&mut self, kind: &str) -> Result<&mut LiveEpisode, RequestError> {
        let live = self.live.as_mut();
        live.ok_or_else(|| format!("{kind}: no episode yet; send reset first").into())
    }

    /// Brings the episode to a state: from the nearest copy that leads to it, or from the start of the episode.
    fn go_to(&mut self, state: &EpisodeState) -> Result<(), RequestError> {
        if !state.actions.is_empty() {
            let reason = "a client restored a state of it";
            self.attempts.exclude("set_state", &state.id, self.attempt.as_ref(), reason)?;
        }
        let copies = self.snapshots.iter().chain(&self.live);
        let candidates = copies.filter_map(|copy| Some((copy.state.steps_to(state)?, copy)));
        let mut live = match candidates.min_by_key(|(steps, _)| *steps) {
            Some((_, copy)) => copy.clone(),
            None => {
                let live = LiveEpisode::start(self.config, state)?;
                self.keep(live.clone());
                live
            }
        };
        for row in &state.actions[live.state.actions.len()..] {
            self.proceed()?;
            live.advance(self.config, row)?;
        }
        let (executed, all) = (live.state.actions.len(), state.actions.len());
        if executed < all {
            bail!("set_state: the episode ends after {executed} of the state's {all} actions");
        }
        self.attempt = None;
        self.live = Some(live);
        Ok(())
    }

    /// Keeps a copy in place of the least recently used one.
    fn keep(&mut self, copy: LiveEpisode) {
        self.snapshots.retain(|other| other.state != copy.state);
        if self.snapshots.len() == MAX_SNAPSHOTS {
            self.snapshots.pop_front();
        }
        self.snapshots.push_back(copy);
    }

    fn step(&mut self, rows: &[ActionRow]) -> Result<Value, RequestError> {
        if self.live("step")?.episode.outcome().is_some() {
            bail!("step: the episode is over; reset first");
        }
        let mut executed = 0;
        for row in rows {
            self.proceed()?;
            let (config, id) = (self.config, self.live("step")?.state.id.clone());
            drop(self.attempts.lock_free("step", &id, self.attempt.as_ref())?);
            let live = self.live("step")?;
            live.advance(config, row)?;
            executed += 1;
            let (count, is_over) = (live.state.actions.len(), live.episode.outcome().is_some());
            if count == 1 {
                self.attempt = self.attempts.begin(&id)?;
            }
            if is_over {
                break;
            }
        }
        let recorded = self.record_if_over()?;
        let (config, done) = (self.config, StepResult { count: executed, recorded });
        response::transition("step", self.live("step")?, config, Some(done))
    }

    /// Records the episode if it is over and this attempt at it counts. Returns whether it was recorded; `None` before
    /// the end, and if the server records nothing.
    fn record_if_over(&mut self) -> Result<Option<bool>, RequestError> {
        let Some(live) = self.live.as_ref().filter(|live| live.episode.outcome().is_some()) else {
            return Ok(None);
        };
        match (&self.config.recorder, self.attempt.take()) {
            (None, _) => Ok(None),
            (Some(_), None) => Ok(Some(false)),
            (Some(_), Some(attempt)) => attempt.record(&live.episode).map(Some),
        }
    }

    fn render(
        &mut self,
        camera: Option<String>,
        width: Option<usize>,
        height: Option<usize>,
    ) -> Result<Value, RequestError> {
        let (budget, cancel) = (self.render_budget, self.cancel);
        let (config, attempts) = (self.config, self.attempts);
        let live = self.live("render")?;
        let cameras = &live.episode.sim.scene.cameras;
        let camera = camera.or_else(|| cameras.first().map(|camera| camera.name.clone())).unwrap_or_default();
        let is_camera = cameras.iter().any(|other| other.name == camera);
        let finger = match camera.as_str() {
            "left" if !is_camera => Some(Side::Left),
            "right" if !is_camera => Some(Side::Right),
            _ => None,
        };
        if finger.is_some() && (width.is_some() || height.is_some()) {
            bail!("render: {camera}: tactile images have one size; omit width and height");
        }
        let own = cameras.iter().find(|other| other.name == camera);
        let width_px = width.or(own.map(|own| own.width)).unwrap_or_default();
        let height_px = height.or(own.map(|own| own.height)).unwrap_or_default();
        let is_resized = own.is_some_and(|own| (width_px, height_px) != (own.width, own.height));
        let is_observed = config.profile.inputs.iter().any(|input| match &input.source {
            ObservationSource::Camera { camera: observed, .. } => *observed == camera && !is_resized,
            ObservationSource::Tactile { finger: observed, .. } => finger == Some(*observed),
            _ => false,
        });
        if !(is_observed || config.privileged) && attempts.is_open(&live.state.id) {
            bail!(
                "render: {camera}: the profile {} does not observe it in this size, and the episode can be recorded; render \
                 what it observes, or another episode",
                config.profile.name
            );
        }
        let pixels = width_px * height_px;
        if (width.is_some() || height.is_some()) && pixels > MAX_RENDER_PIXELS {
            bail!(
                "render: width × height is {width_px} × {height_px}; expected at most {MAX_RENDER_PIXELS} pixels \
                 (1920 × 1080)"
            );
        }
        let Some(_permit) = budget.acquire(pixels, cancel) else {
            bail!("the server is shutting down");
        };
        let image = match finger {
            Some(side) => live.episode.render_tactile(side),
            None => live.episode.render_camera(&camera, width, height),
        };
        let image = image.map_err(|e| format!("render: {e}"))?;
        Ok(response::typed("render", [("image", pack_array(image_array(image), true))]))
    }

    fn get_state(&mut self) -> Result<Value, RequestError> {
        let copy = self.live("get_state")?.clone();
        let state = copy.state.to_value(self.config);
        self.keep(copy);
        Ok(response::typed("get_state", [("state", state)]))
    }

    /// Ends a request once the server is cancelled.
    fn proceed(&self) -> Result<(), RequestError> {
        if self.cancel.requested() {
            bail!("the server is shutting down");
        }
        Ok(())
    }
}
