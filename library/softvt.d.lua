---@meta softvt
-- Generated from the declarations in src/script; do not edit.

---A set of tasks that are reported together.
---@class softvt.Suite
---@field name string Name in results; part of the seed.
---@field object_type "deformable"|"rigid" Mechanics of the objects.
---@field tasks_differ_in "object"|"spatial" Difference between the tasks.
---@field needs? "nothing"|"size"|"trial" Knowledge of an instance that a safe grip needs, as softvt list suites prints it: "nothing" but its kind, its "size", or what only a "trial" tells. softvt scripts/blind_bounds.lua estimates it.
---@field episodes? integer Default number of episodes per task. Expects a whole number in 1..1000000. Default 5.
---@field tasks softvt.Task[] The tasks, in order.
---@field shifts? softvt.Shift[] Changes of the scene that a run can request.
---@field metrics? softvt.Metric[] Numbers of each episode that records and tables show in addition to the verdict.
---@field vary? softvt.Variation Ranges from which the soft objects, the light and the cameras of every episode are drawn.
---@field settings? softvt.Settings Changed settings (docs/settings.md): { physics = {…}, robot = {…}, criteria = {…}, tactile = {…}, cameras = {…} }.
---@field twin_of? string Name of the suite of soft objects whose rigid twin this is. All soft bodies become rigid, with the same shape, mass and looks; initial states are those of that suite, so tasks and layouts must be its own.
---@field teacher? "expert"|"tactile-servo" Policy whose demonstrations softvt record keeps unless --policy names another: that of the hidden suites is "tactile-servo", which shows how a grip is found. By default the expert.

---A task of a suite.
---@class softvt.Task
---@field prompt string Instruction for the policy, and name of the task in results.
---@field episode_prompt? fun(scene: softvt.Scene, rng: softvt.Rng): string Returns the prompt of an episode, given its initial scene: for prompts that name what was drawn, as the larger of two objects or the side of the plate. It must not change the scene. Shifts come after it.
---@field layout softvt.Layout Layout of the initial scene.
---@field goal softvt.Goal Success criterion of the task.
---@field object? string Scene name of the object whose deformation and grip the records hold; by default the first that the goal names. A goal of joints or functions alone needs it.
---@field expert? fun(arm: softvt.Arm, scene: softvt.SceneState) A coroutine that solves the task with privileged state.
---@field budget_steps? integer Control steps (20 Hz) that the policy has; by default 500 in suites that vary layouts, 700 in those that vary objects. Expects a whole number in 1..100000.

---The layout of a scene. Tasks with the same layout name share their initial states.
---@class softvt.Layout
---@field name string Name; part of the seed.
---@field build fun(scene: softvt.Scene, rng: softvt.Rng) Adds the objects to the scene.

---The object rests on the target, released, for a time.
---@class softvt.On
---@field object string Scene name of the object.
---@field target string Scene name of the target, or of a part of it (cabinet.top_drawer).
---@field hold_s? number Time that it must stay there. Expects seconds in 0..10. Default 0.4.

---The object rests in the target's cavity, carried by it or by objects in it, released, for a time. The cavity is the space in which its shape holds water.
---@class softvt.Inside
---@field object string Scene name of the object.
---@field target string Scene name of the target, or of a part of it (cabinet.top_drawer).
---@field hold_s? number Time that it must stay there. Expects seconds in 0..10. Default 0.4.

---Each object rests on the one before it in the list, released, for a time.
---@class softvt.Stacked
---@field objects string[] Scene names, from the lowest object on; at least two.
---@field hold_s? number Time that they must stay there. Expects seconds in 0..10. Default 0.4.

---A joint is open.
---@class softvt.Opened
---@field joint string Part of an articulated object (cabinet.top_drawer).
---@field share? number Smallest share of its range, from the lowest value on. Expects a number in 0..1. Default 0.7.

---A joint is closed.
---@class softvt.Closed
---@field joint string Part of an articulated object (cabinet.top_drawer).
---@field share? number Largest share of its range, from the lowest value on. Expects a number in 0..1. Default 0.1.

---The value of a joint is within a range.
---@class softvt.Turned
---@field joint string Part of an articulated object (stove.knob).
---@field range number[] Lowest and highest value, rad of a hinge and m of a slider. Expects a list of 2 numbers in -6.2832..6.2832 (rad or m).

---The centres of two objects are near each other in the horizontal plane, and the robot does not touch the object, for a time.
---@class softvt.Near
---@field object string Scene name of the object.
---@field target string Scene name of the target, or of a part of it.
---@field distance? number Largest distance of the centres. Expects metres in 0.001..1.5. Default 0.15.
---@field hold_s? number Time that it must stay there. Expects seconds in 0..10. Default 0.4.

---The object is beside the target, within 45° of a direction of the robot's base, and the robot does not touch it, for a time.
---@class softvt.Beside
---@field side "left_of"|"right_of"|"in_front_of"|"behind" Side of the target: "left_of" (+y of the base), "right_of", "in_front_of" (nearer to the robot, −x) or "behind".
---@field object string Scene name of the object.
---@field target string Scene name of the target, or of a part of it.
---@field distance? number Smallest distance of the centres in that direction. Expects metres in 0..1.5. Default 0.05.
---@field hold_s? number Time that it must stay there. Expects seconds in 0..10. Default 0.4.

---The z axis of the object is upright, and the robot does not touch the object, for a time.
---@class softvt.Upright
---@field object string Scene name of the object.
---@field angle? number Largest angle between the axis and the vertical. Expects radians in 0..3.1. Default 0.17.
---@field hold_s? number Time that it must stay so. Expects seconds in 0..10. Default 0.4.

---A function of the true scene returns true at the end of a control step. It must depend on its argument alone: variables that it changes are not part of the state of an episode.
---@class softvt.Predicate
---@field name string Condition in words, for records and reports.
---@field holds fun(scene: softvt.SceneState): boolean Returns true if the condition holds.

---All of these goals hold at once.
---@class softvt.All
---@field goals softvt.Goal[] Goals that must hold.

---At least one of these goals holds.
---@class softvt.Any
---@field goals softvt.Goal[] Goals of which one must hold.

---None of these goals holds.
---@class softvt.None
---@field goals softvt.Goal[] Goals that must not hold.

---Each of these goals has held once after the one before it had, and the last one holds.
---@class softvt.Sequence
---@field goals softvt.Goal[] The goals, in order.

---A change of the scene that a run can request with --shift name=value. Limits of D stay those of the assets.
---@class softvt.Shift
---@field name string Name on the command line.
---@field unit? string Unit of the value. Default "1".
---@field default number Value that changes nothing. Expects a number.
---@field min? number Lowest value that is accepted. Expects a number.
---@field max? number Highest value that is accepted. Expects a number.
---@field apply fun(scene: softvt.Scene, value: number, rng: softvt.Rng): softvt.Scene? Changes the scene; may return another one. scene.goal_object is the object of the task's goal and scene.prompt the instruction. Draw from rng:stream "camera", "light", "material" or "sensor", whichever the shift changes.

---A number of each episode in addition to its verdict, from the true state, which policies do not see.
---@class softvt.Metric
---@field name string Name in records and tables, with its unit, as tilt_deg; none that records have already, as safety.
---@field of fun(scene: softvt.SceneState, step: table): number? Returns the value after a control step, or nil where it has none. `step` is a row of the trace (docs/results.md): forces of the pads, D of each object, what touches what.
---@field over? "last"|"max"|"min"|"mean" Reduction of the values of an episode: "last", "max", "min" or "mean". Default "last".

---Ranges from which every episode of a suite draws: factors on size, stiffness, density and friction of each soft object, its colour, the light and the poses of the cameras. The policy sees none of the drawn numbers; records do.
---@class softvt.Variation
---@field name string Name of the variation in results.
---@field size number[] Smallest and largest factor on the size of a soft object, uniform. Expects a list of 2 numbers in 0.1..10.
---@field stiffness number[] Factors on Young's modulus, log-uniform. Expects a list of 2 numbers in 0.1..10.
---@field density number[] Factors on the density, log-uniform. Expects a list of 2 numbers in 0.1..10.
---@field friction number[] Factors on the coefficients of friction, log-uniform. A pair of surfaces takes the larger coefficient. Expects a list of 2 numbers in 0.1..10.
---@field colour number Largest relative change of each colour channel of a soft object. Expects a number in 0..0.9.
---@field light number[] Factors on the strength of lamp and sky, log-uniform. Expects a list of 2 numbers in 0.1..10.
---@field camera_offset number Largest displacement along each axis of the cameras that are fixed to the world. Expects metres in 0..1.
---@field camera_rotation number Largest rotation of these cameras about each of their axes. Expects radians in 0..1.
---@field hidden? softvt.Hidden Properties of the soft objects that do not show.

---Ranges of properties that do not show, drawn log-uniform for each soft object. Size, colour and looks do not depend on them. An instance is drawn again until the ratio of its largest to its smallest safe grip force is within window_ratio by the draw reference of the asset, which its first calibration writes and later ones keep. Policies never see these numbers; records have them, with the ratio by the present calibration.
---@class softvt.Hidden
---@field aeration number[] Relative density of the foam: a factor on the density, and by its square on Young's modulus. Expects a list of 2 numbers in 0.1..10.
---@field staling number[] Age: a factor on Young's modulus; the collapse and damage strains shrink by its power 0.7, and τ of the instance with them. Expects a list of 2 numbers in 0.1..10.
---@field filling number[] Factor on the mass. Expects a list of 2 numbers in 0.1..10.
---@field coating number[] Static friction of a coating (flour, oil, glaze), which acts between the object and everything that it touches. Expects a list of 2 numbers in above 0..10.
---@field window_ratio number[] Largest over smallest safe grip force of the instances that are kept, at least 1. Expects a list of 2 numbers in 1..1000.

---Runs suites as they are, then under each condition, and compares them episode by episode.
---@class softvt.Conditions
---@field name string Name of the plan in results.
---@field suites softvt.Suite[] The suites, in order.
---@field conditions softvt.Condition[] The conditions, in order.

---A difference between a run and its reference: other shifts, settings or another policy, with the same tasks, initial states and seeds.
---@class softvt.Condition
---@field name string Name in the table of results and of the run folder.
---@field shift? table<string, number> Shifts by name, as for --shift: { mass = 1.25 }.
---@field set? table<string, number|boolean|string> Settings by path, as for --set: { ["robot.gripper.effort"] = 20 }.
---@field policy? string Built-in policy in place of that of the run: "tactile-servo" (softvt list policies).
---@field replay? boolean True to repeat the actions of the reference, so that only their effect differs. Default false.
---@field only? "deformable"|"rigid" object_type of the suites that it applies to; others are not run, and their row says N/A.
---@field rigid_twin? boolean True to run the rigid twin of the suites: shapes, masses, looks, layouts and prompts stay. Default false.

---A function that is evaluated at points and returns rows of results. Give either grid or points.
---@class softvt.Experiment
---@field name string Name of the experiment in results.
---@field options? any Result of softvt.options, passed to the functions below as opt.
---@field grid? table<string, any[]> Values of each parameter. Every combination is run, names in alphabetical order, the last one fastest.
---@field points? fun(opt: table): table[] Returns the points instead of a grid.
---@field run fun(point: table, opt: table): table|table[] Returns a row, or a list of rows, for one point. Points run in any order and on several threads, each in a new run of the script: variables that one changes are not seen by others. Reading a field of the point that is no parameter of the grid, or a misspelt one of `points`, is an error.
---@field finish? fun(rows: table[], opt: table): softvt.Finish? Summarizes the rows of all points.
---@field columns? string[] Columns of the table, in order; by default all, sorted.

---A kind of object. Its shape at rest has its lowest point at z = 0 and its centre on the z axis (see softvt.Shape:grounded).
---@class softvt.Asset
---@field name string Name in results and calibration files.
---@field shape softvt.Shape Shape, in metres.
---@field body softvt.Soft|softvt.Rigid|softvt.Articulated|softvt.Static|softvt.Scenery Mechanics: soft, rigid, articulated, static or scenery.
---@field friction? softvt.Friction Friction of its surface.
---@field visuals? softvt.Visual[] Visuals by material id of the shape, from 0; by default the colours of its mesh file, or plain grey.
---@field hints? table<string, number> Numbers for experts (grasp height …). Those whose names end in _m are lengths, which follow an object's scale.

---A finite-element soft body of linear-elastic, isotropic material.
---@class softvt.Soft
---@field youngs_pa number Young's modulus. Expects pascals above 0.
---@field poisson number Poisson's ratio; 0.5 would be incompressible. Expects a number in 0..below 0.5.
---@field density number Density of the solid part. Expects a number (kg/m³) above 0.
---@field resolution? integer Voxels along the longest edge of the bounding box. Expects a whole number in 1..64. Default 6.
---@field grasp_spacing? number Spacing of contact samples where a gripper can reach. Expects metres in 0.0001..0.02. Default 0.00075.
---@field collapse_strain? number Compressive strain at which cell walls buckle and a plateau of stress begins; a calibration presses no further. Expects a number in above 0..1.
---@field damage_strain? number Compressive strain that leaves a visible crack or set. Expects a number in above 0..1.
---@field loss_factor? number Loss factor tan δ, which is nearly constant from 1 to 10 Hz; youngs_pa is then the modulus at rest. 0 leaves the damping to the setting physics.rayleigh_stiffness. Expects a number in 0..0.6. Default 0.

---A free rigid body of uniform density.
---@class softvt.Rigid
---@field density number Density of the whole volume. Expects a number (kg/m³) above 0.

---Parts on joints. The asset's own shape is their base, which never moves.
---@class softvt.Articulated
---@field parts softvt.Part[] The parts, in any order.

---A part of an articulated object. Parts of one object never touch each other or its base.
---@class softvt.Part
---@field name string Name, unique in the object. A scene names the part cabinet.top_drawer.
---@field shape softvt.Shape Shape with all joints at 0, in the frame of the whole object. Walls must be at least 4 mm thick.
---@field density number Density of the part. Expects a number (kg/m³) above 0.
---@field joint softvt.Slider|softvt.Hinge Joint that carries it; axes and origins are in the frame of the whole object.
---@field parent? string Name of the part that carries it; the fixed base by default.
---@field visuals? softvt.Visual[] Visuals by material id of its shape, from 0; those of the asset by default.
---@field hints? table<string, number> Numbers for experts (handle height …).

---A joint along which a part slides, such as that of a drawer. Values are in m.
---@class softvt.Slider
---@field axis number[] Direction in which its value grows. Expects a list of 3 numbers (object frame).
---@field lower number Lowest value of the joint. Expects metres.
---@field upper number Highest value, above the lowest. Expects metres.
---@field damping? number Viscous damping of the joint. Expects a number (N s/m) of 0 or more. Default 0.
---@field friction? number Dry friction of the joint. Expects a number (N) of 0 or more. Default 0.

---A joint about which a part turns, such as that of a door or a knob. Values are in rad.
---@class softvt.Hinge
---@field axis number[] Axis about which its value grows, right-handed. Expects a list of 3 numbers (object frame).
---@field origin number[] A point of the axis, with all joints at 0. Expects a list of 3 numbers (m, object frame).
---@field lower number Lowest value of the joint. Expects radians in -6.2832..6.2832.
---@field upper number Highest value, above the lowest. Expects radians in -6.2832..6.2832.
---@field damping? number Viscous damping of the joint. Expects a number (N m s/rad) of 0 or more. Default 0.
---@field friction? number Dry friction of the joint. Expects a number (N m) of 0 or more. Default 0.

---The appearance of a surface: a base material, and layers painted over it in order.
---@class softvt.Visual
---@field albedo number[] Colour of the base. Expects a list of 3 numbers in 0..1 (linear RGB).
---@field roughness? number Roughness: 0 is a mirror, 1 is chalk. Expects a number in 0..1. Default 0.6.
---@field metalness? number Metalness: 1 is bare metal. Expects a number in 0..1. Default 0.
---@field layers? softvt.Layer[] Layers painted over the base, in this order.

---A colour laid over the layers below where a mask is not 0.
---@class softvt.Layer
---@field mask? softvt.Mask Weight of the layer; 1 everywhere by default.
---@field albedo number[] Colour of the layer. Expects a list of 3 numbers in 0..1 (linear RGB).
---@field roughness? number Roughness: 0 is a mirror, 1 is chalk. Expects a number in 0..1. Default 0.6.
---@field opacity? number Share of this layer where the mask is 1; with 0 only the relief shows. Expects a number in 0..1. Default 1.
---@field relief_m? number Height of the drawn surface where the mask is 1. It is drawn only: contact does not see it. Expects metres in -0.005..0.005. Default 0.

---A fixed body, which never moves.
---@class softvt.Static

---Scenery: it is drawn and casts shadows, but has no contact.
---@class softvt.Scenery

---Coulomb friction of a surface. A pair of surfaces has the larger of each coefficient, unless one is coated.
---@class softvt.Friction
---@field static_mu? number Static coefficient, 0 for none. Expects a number in 0..10. Default 0.6.
---@field dynamic_mu? number Dynamic coefficient, at most the static one. Expects a number in 0..10. Default 0.5.
---@field coated? boolean True for a layer on the surface (flour, oil, glaze), whose coefficients are those of any pair. Default false.

---A policy, as the file given to --policy returns it. Every episode has a virtual machine of its own, in which the file runs again; math.random is seeded by the episode.
---@class softvt.Policy
---@field name string Name in results, unless --name gives another.
---@field observes? softvt.Observes Observations of the policy.
---@field reset? fun(task: softvt.EpisodeBrief) Called when the episode begins.
---@field act fun(obs: softvt.Observation): softvt.Action|softvt.Action[] Returns the action of this control step, or a list of actions for the next ones.
---@field replan? integer Number of actions of a list that are executed before act is called again, unless --replan gives another; all by default. Expects a whole number in 1..10000.
---@field gripper? "continuous"|"binary"|"two-width"|"force" Grip code, which says what the closure of an action commands, unless --gripper gives another: a closure (continuous); open, or above 0.5 closed with the whole effort (binary); open, or the width given just after closing (two-width). For force, actions have force. By default an action has closure, which is continuous, or force.
---@field privileged? boolean True to let the policy use limits and materials of objects: softvt.calibration, assets, and the modules strain_sources and experts. Its results say that it is privileged. Default false.

---The observations of a policy; nothing else is computed.
---@class softvt.Observes
---@field cameras? string[] Names of cameras of the scene.
---@field tactile? boolean True to get the tactile images and markers of the fingers. Default false.
---@field drives? boolean True to get the commanded closure and the exact width, whose gap is the grip force: 1 mm per N. Without it, the width has the steps and the offset of a real hand. Default false.
---@field force? boolean True to get the true forces on the gels, which no real sensor gives; results then say force_observed. Default false.

---The messages of a policy server: the observations it gets and the meaning of its actions. The file given to --profile returns one.
---@class softvt.Profile
---@field name string Name in results, unless --name gives another.
---@field inputs softvt.Input[] Observations that are sent, in order.
---@field actions softvt.ActionEncoding Meaning of the actions.
---@field observe_every_step? boolean True to send an observation in every control step, for policies with a history of their own. Those without a need for actions have wants_actions = false in the identity of the request; any reply answers them. Default false.

---One entry of the observations that are sent to a policy server.
---@class softvt.Input
---@field keys string[] Keys under which it is sent.
---@field source "camera"|"depth"|"segmentation"|"state"|"prompt"|"tactile_image"|"tactile"|"marker_motion"|"force"|"query"|"query_seed" Content: the image of a camera, its depth (m), or the object at each pixel; numbers of the robot's state; the prompt; the mosaic of 8 tactile images of both fingers; the image of one finger; the initial and the last marker positions; the last true forces on the gels; the identity of the request, a map; a seed for policies that draw random numbers, equal whenever a run is repeated.
---@field camera? string For camera, depth and segmentation: the camera's name in the scene.
---@field half_turn? boolean For camera, depth and segmentation: true to rotate the image by 180°.
---@field parts? ("position"|"axis_angle"|"quaternion_wxyz"|"quaternion_xyzw"|"joints"|"joint_velocities"|"joint_torques"|"gripper_width"|"finger_position"|"sensed_width"|"sensed_finger_position"|"finger_pair"|"closure")[] For state: its parts in order, in m, rad, rad/s and N m, of 3 numbers (position, axis_angle), 4 (quaternions), 7 (joints, joint_velocities, joint_torques), 2 (finger_pair) and 1. The sensed width has the steps and the offset of a real hand; the gap between the exact one and the commanded closure is the grip force.
---@field frames? integer Number of control steps in the entry, the present one last, along a first axis; not for prompt and tactile_image. By default the present step without that axis, and 8 steps of marker_motion and force. The start of an episode repeats its first step. Expects a whole number in 1..32.
---@field markers? "dots"|"arrows"|"black_arrows" For tactile and tactile_image: style in which the markers are drawn into the images; not drawn by default.
---@field layout? "rows"|"columns" For tactile_image: the left finger above the right one (rows, the default) or left of it.
---@field finger? "left"|"right" For tactile: the finger.

---The meaning of the numbers of an action: three of position, three of orientation (axis-angle), or seven joint positions, and one of the gripper; further ones are padding.
---@class softvt.ActionEncoding
---@field pose "absolute"|"delta"|"delta_osc"|"joints" absolute: a pose in the base frame. delta: shares -1 to 1 of a step away from the tool's pose. delta_osc: the same, reduced to what robosuite's controller reaches within a control step. joints: positions of the seven joints of the arm, rad.
---@field translation_m? number For delta and delta_osc: the step of a share of 1, m. Expects a number in above 0..10.
---@field rotation_rad? number For delta and delta_osc: the rotation of a share of 1, rad. Expects a number in above 0..10.
---@field scale? number[] Factors on the numbers before that of the gripper, six or seven, applied first.
---@field offset? number[] Offsets added after that.
---@field length? integer Length that an action must have, padding included; by default 7, or 8 for joints, or 32 as openpi's models pad them. Expects a whole number in 7..4096.
---@field gripper? softvt.GripperValues The number of the gripper.

---The number of the gripper, the last of an action without padding.
---@class softvt.GripperValues
---@field open? number Value that opens the gripper; not for code = "force". Expects a number.
---@field closed? number Value that closes it; not for code = "force". Expects a number.
---@field code? "continuous"|"binary"|"two-width"|"force" Command of the value. continuous: a closure in proportion between open and closed, the default. binary: closed beyond the middle, else open. two-width: open, or the width that the answers give just after closing, held until one opens. force: a grip force in N at which closing stops; below 0 opens.
---@field latch? softvt.GripHysteresis For code = "binary": limits at which the gripper closes and opens, instead of the middle.

---Hysteresis of a binary gripper, in the unit of the gripper's number.
---@class softvt.GripHysteresis
---@field close number Value from which on, towards that of the closed gripper, an answer closes. Expects a number.
---@field open number Value from which on, towards that of the open gripper, an answer opens. Expects a number.
---@field hold_steps? integer Control steps for which a change is kept, whatever is answered. Expects a whole number in 0..10000. Default 0.

---Summary of an experiment.
---@class softvt.Finish
---@field text? string Printed after the rows.
---@field files? table<string, string|softvt.Image|table<string, any>|any[]> Files to write, by relative path: text as it is, images as PNG, tables as JSON with sorted keys.
---@field problem? string Fault of the results. The files are written, then the command fails with this message.

---A command for one control step (0.05 s): a pose of the tool centre point in the robot's base frame, or positions of the arm's joints, and a closure or a grip force. Give either joints, or position with axis_angle or quaternion; and either closure or force.
---@class softvt.Action
---@field position? number[] Position of the tool. Expects a list of 3 numbers (m, base frame).
---@field axis_angle? number[] Orientation as axis-angle. Expects a list of 3 numbers (rad, base frame).
---@field quaternion? number[] Orientation of the tool, as quaternion. Expects a list of 4 numbers (w, x, y, z, base frame).
---@field joints? number[] Positions of the arm's joints, from the base on. Expects a list of 7 numbers (rad).
---@field closure? number Gripper closure: 0 is open, 1 is closed. The grip code of the policy says what it commands. Expects a number in 0..1.
---@field force? number Grip force at which closing stops, at most robot.gripper.effort; below 0 opens. Expects a number (N).

---Returns an empty world: soft bodies among fixed or prescribed solids, without a robot. Settings of the command line, --set physics.…, take precedence in experiments.
---@class softvt.WorldSpec
---@field dt? number Time step: the setting physics.dt, with its default and range. Expects seconds.
---@field rayleigh_mass? number Mass-proportional Rayleigh damping: the setting physics.rayleigh_mass. Expects a number (1/s).
---@field rayleigh_stiffness? number Stiffness-proportional Rayleigh damping: the setting physics.rayleigh_stiffness. Expects seconds.
---@field average_acceleration? boolean True for average acceleration: the setting physics.average_acceleration.
---@field gravity? number[] Gravity; {0, 0, -9.81} by default. Expects a list of 3 numbers (m/s²).
---@field sleeping? boolean True if bodies at rest fall asleep: the setting physics.sleeping.

---Builds a scene with the robot and lets it settle. Deformation refers to the settled shapes.
---@class softvt.SimulateSpec
---@field layout softvt.Layout Layout of the initial scene.
---@field suite? string Part of the seed. Default "experiment".
---@field episode? integer Part of the seed. Expects a whole number in 0..1000000000. Default 0.
---@field seed? integer Part of the seed; by default that of the run, --seed. Expects a whole number in 0..1000000000.
---@field settings? softvt.Settings Changed settings of physics, robot, tactile sensors and cameras (docs/settings.md): { physics = {…}, robot = {…} }. Those of the command line, --set, take precedence in experiments.

---Returns the results of a calibration: the safe window, the deformation limit τ, and the files to write.
---@class softvt.EnvelopeSpec
---@field asset string Name of the asset.
---@field protocol? "press"|"hand" Protocol of the sweep. Default "press".
---@field kappa? number Safety factor κ of the deformation limit τ = κ D_ref. Expects a number in 0..1. Default 0.5.
---@field stable_strain? number Stable strain of the material, at which 5 % of the volume ends the press. Expects a number in above 0..1.
---@field ended? string Why the sweep ended, if its last row does not tell.
---@field fingerprint? string Fingerprint of the calibrated asset, as softvt.fingerprint returns it. Results for another object of that name then do not use the calibration.
---@field holds table<string, any>[] Rows width_mm, closure, trials, held, slip_mm, d_peak_pct of the scan for the loose end.
---@field sweep table<string, any>[] Rows width_mm, closure, d_pct, d_v1_pct, force_n, strain_p95, min_det_f, node_speed_m_s, both_pads, slip_mm, stable of the compression sweep.
---@field variants? table<string, any>[] Presses at other sizes and stiffnesses: { scale, youngs_factor, rows }, with the rows width_mm, d_pct, force_n, strain_p95.

---Returns the safe window of an instance of a calibrated asset; nil without a window. Experts see the factors as fields of their objects.
---@class softvt.Instance
---@field asset string Name of the asset.
---@field scale? number Factor on the size. Expects a number above 0. Default 1.
---@field youngs_factor? number Factor on Young's modulus. Expects a number above 0. Default 1.
---@field density_factor? number Factor on the density. Expects a number above 0. Default 1.
---@field strain_factor? number Factor on the stable strain. Expects a number above 0. Default 1.
---@field coating? number Static friction of its coating. Expects a number in above 0..10.

---Returns instances of an asset as the episodes of a suite draw them, from a random stream that no episode uses. Without a variation each is the asset itself.
---@class softvt.Sample
---@field asset softvt.Asset Asset of the instances.
---@field variation? softvt.Variation Variation of the suite.
---@field suite string Name of the suite; part of the seed.
---@field count integer Number of instances to draw. Expects a whole number in 1..10000.

---Returns an image of one colour: `softvt.image { width = 640, height = 480, colour = { 255, 255, 255 } }`.
---@class softvt.NewImage
---@field width integer Width, pixels. Expects a whole number in 1..8192.
---@field height integer Height, pixels. Expects a whole number in 1..8192.
---@field colour number[] Colour of every pixel. Expects a list of 3 numbers (sRGB of 0 to 255).

---Returns a plot as SVG, for the files of an experiment: `softvt.plot { title = "…", x = { label = "gap" }, y = { label = "D, %" }, series = { { label = "bun", points = { { 40, 0.1 }, { 38, 0.4 } } } } }`.
---@class softvt.Plot
---@field title string Title above the plot.
---@field x softvt.PlotAxis The horizontal axis, linear or logarithmic.
---@field y softvt.PlotAxis The vertical axis, linear or logarithmic.
---@field series softvt.PlotSeries[] The series, at most six.
---@field levels? softvt.PlotLevel[] Horizontal lines, such as limits.

---An axis of a plot.
---@class softvt.PlotAxis
---@field label string Title, with the unit.
---@field log? boolean True for a logarithmic axis, whose values must be positive. Default false.

---Values of a plot that belong together.
---@class softvt.PlotSeries
---@field label? string Name at the last point.
---@field points number[][] Points { x, y }, in the order in which a line joins them.
---@field line? boolean False for points without a line. Default true.

---A horizontal line of a plot.
---@class softvt.PlotLevel
---@field y number Value on the vertical axis. Expects a number.
---@field label? string Text on the line.

---Returns a pose in the world frame: `softvt.pose { position = { 0.4, 0, 0.2 }, yaw = math.pi / 2 }`. Without a quaternion the hand points straight down.
---@class softvt.PoseSpec
---@field position number[] Position of the pose. Expects a list of 3 numbers (m, world).
---@field yaw? number Rotation of the downward hand about the vertical, by default 0. Expects radians in -6.2832..6.2832.
---@field quaternion? number[] Orientation instead of yaw. Expects a list of 4 numbers (w, x, y, z).

---Reads a shape from an OBJ, STL or GLB file: `softvt.mesh { file = "mug.obj", scale = 0.001 }`. The surface must be closed. An asset without visuals has the colours and images of the materials in the file: Kd and map_Kd of the MTL files that an OBJ file names, or the base colours of a GLB file; images are PNG or JPEG. All objects of the file are one shape; of a GLB file those of its default scene. Vertices within 1e-6 of the diagonal are one where the surface is open without that.
---@class softvt.MeshSpec
---@field file string Path inside of the project, next to the Lua file or from a root folder.
---@field scale? number Metres per unit of the file: 0.001 for millimetres. Expects metres above 0. Default 1.
---@field z_up? boolean True if z is up in the file, false if y is. By default y in a GLB file, as glTF says, and z in others.

---An option of the script: key gap_mm is --gap-mm on the command line. The default determines the type.
---@class softvt.Option
---@field default any A number, string, boolean, or list of numbers or strings.
---@field integer? boolean True if only whole numbers are allowed. Default false.
---@field unit? string Unit of a number. Default "".
---@field min? number Lowest number that is accepted. Expects a number.
---@field max? number Highest number that is accepted. Expects a number.
---@field choices? string[] The allowed strings; any by default.
---@field help? string Description for --help. Default "".
---@field only_with? table<string, any> Values of other options without which this one does nothing, and is refused: { sweep_protocol = "hand" }. A list must contain the value.
---@field needs_out? boolean True if files that are made with another value than the default must not replace those of the project: such a value then needs --out. Default false.

---A box centred on the origin.
---@class softvt.BoxSpec
---@field size number[] Edge lengths along x, y and z. Expects a list of 3 numbers (m).

---A sphere centred on the origin.
---@class softvt.SphereSpec
---@field radius number Radius of the sphere. Expects metres above 0.

---An ellipsoid centred on the origin.
---@class softvt.EllipsoidSpec
---@field size number[] Diameters along x, y and z. Expects a list of 3 numbers (m).

---A capsule along the z axis, centred on the origin.
---@class softvt.CapsuleSpec
---@field radius number Radius of the tube and its caps. Expects metres above 0.
---@field length number Total length including the caps; at least twice the radius. Expects metres above 0.

---A cylinder along the z axis, centred on the origin.
---@class softvt.CylinderSpec
---@field radius number Radius of the cylinder. Expects metres above 0.
---@field height number Height of the cylinder. Expects metres above 0.

---A torus about the z axis, centred on the origin.
---@class softvt.TorusSpec
---@field major number Radius of the centre line of the tube. Expects metres above 0.
---@field minor number Radius of the tube, less than major. Expects metres above 0.

---A triangular prism along y in a box centred on the origin.
---@class softvt.WedgeSpec
---@field size number[] Edge lengths of the box. Expects a list of 3 numbers (m).
---@field apex? number Position of the top edge across the width: -1 and 1 are the sides, 0 the middle. Expects a number in -1..1. Default 0.

---A polygon in (x, z), extruded along y and centred on y = 0.
---@class softvt.PrismSpec
---@field corners number[][] Corners (x, z) in order.
---@field length number Length of the prism along y. Expects metres above 0.

---A profile revolved about the z axis.
---@class softvt.LatheSpec
---@field corners number[][] Corners (r, z) in order, with r ≥ 0.

---Cubes, every other one 1; one corner is at the origin.
---@class softvt.CheckerMask
---@field size_m number Edge of a cube. Expects metres of 0.000001 or more.

---Slabs across an axis.
---@class softvt.StripesMask
---@field axis "x"|"y"|"z"|number[] Direction in which they follow each other. Expects one of "x", "y", "z" or a list of 3 numbers (any length).
---@field pitch_m number Distance from one to the next. Expects metres of 0.000001 or more.
---@field share? number Share of the pitch that is 1. Expects a number in 0..1. Default 0.5.

---Rises smoothly from 0 to 1 along an axis.
---@class softvt.GradientMask
---@field axis? "x"|"y"|"z"|number[] Direction of the gradient. Expects one of "x", "y", "z" or a list of 3 numbers (any length). Default "z".
---@field from_m number Coordinate at which it is 0. Expects metres.
---@field to_m number Coordinate at which it is 1; may be below from_m. Expects metres.

---Cloudy noise with values around 0.5, few below 0.2 or above 0.8.
---@class softvt.NoiseMask
---@field size_m number|number[] Size of the coarsest features: one number for all axes, or one for each of x, y and z.
---@field octaves? integer Octaves, each half the size and half the weight of the one before. Expects a whole number in 1..8. Default 3.
---@field from? number Value of the noise that becomes 0. Expects a number in -1..2. Default 0.35.
---@field to? number Value of the noise that becomes 1; may be below from. Expects a number in -1..2. Default 0.65.
---@field seed? integer Seed of the pattern. Expects a whole number in 0..4294967295. Default 0.

---Annual rings of a trunk: cylinders about a line along z, distorted by noise.
---@class softvt.RingsMask
---@field centre_m number[] A point of the line. Expects a list of 3 numbers (m).
---@field pitch_m number Distance from one ring to the next. Expects metres of 0.000001 or more.
---@field wobble_m? number Amplitude of the distortion. Expects metres of 0.000001 or more. Default 0.01.
---@field seed? integer Seed of the pattern. Expects a whole number in 0..4294967295. Default 0.

---Boards along x, side by side in y, with one value per board.
---@class softvt.BoardsMask
---@field length_m number Length of a board. Expects metres of 0.000001 or more.
---@field width_m number Width of a board. Expects metres of 0.000001 or more.
---@field seed? integer Seed of the pattern. Expects a whole number in 0..4294967295. Default 0.

---The gaps between boards of these sizes.
---@class softvt.SeamsMask
---@field length_m number Length of a board. Expects metres of 0.000001 or more.
---@field width_m number Width of a board. Expects metres of 0.000001 or more.
---@field gap_m number Width of a gap. Expects metres of 0.000001 or more.

---Round specks, scattered in space.
---@class softvt.SpecksMask
---@field spacing_m number Mean distance of the specks. Expects metres of 0.000001 or more.
---@field radius_m number Radius, at most half the spacing. Expects metres of 0.000001 or more.
---@field seed? integer Seed of the pattern. Expects a whole number in 0..4294967295. Default 0.

---A plain weave in x and y: high in the middle of a thread.
---@class softvt.WeaveMask
---@field pitch_m number Width of a thread. Expects metres of 0.000001 or more.

---Surfaces that face a direction, by the cosine between their normal and that direction.
---@class softvt.FacingMask
---@field axis? "x"|"y"|"z"|number[] Direction that is compared with the normals. Expects one of "x", "y", "z" or a list of 3 numbers (any length). Default "z".
---@field from? number Cosine at which it is 0. Expects a number in -1..1. Default 0.
---@field to? number Cosine at which it is 1; may be below from. Expects a number in -1..1. Default 1.

---The inside of a shape: a painted rim, the grooves between ridges.
---@class softvt.InsideMask
---@field shape softvt.Shape Shape whose inside is 1.
---@field soft_m? number Width of the border, half of it on either side of the shape's surface. Expects metres of 0 or more. Default 0.

---The letters of a line of text, printed on surfaces that face the reader. Surfaces with text are drawn in finer detail.
---@class softvt.TextMask
---@field text string At most 64 letters.
---@field height_m number Height of a capital letter. Expects metres in 0.0005..1.
---@field at number[] Middle of the line; of a wrapped line, only the height counts. Expects a list of 3 numbers (m).
---@field facing "+x"|"-x"|"+y"|"-y"|"+z"|"-z"|number[] Direction that the printed surface faces. The top of the letters points to +y on top faces, else to +z. Expects one of "+x", "-x", "+y", "-y", "+z", "-z" or a list of 3 numbers (any length).
---@field angle? number Rotation of the line on its surface, counter-clockwise for the reader. Expects radians in -6.2832..6.2832. Default 0.
---@field wrap_m? number Radius of the upright cylinder about the z axis that the line is wrapped around; flat by default. Expects metres of 0.000001 or more.
---@field weight? number Thickening of the strokes, in heights of a capital letter. Expects a number in 0..0.25. Default 0.08.
---@field font? "sans"|"mono" Typeface of the letters. Default "sans".

---Rotates the shape about an axis through the origin.
---@class softvt.RotateSpec
---@field axis "x"|"y"|"z" Axis of the rotation.
---@field angle number Right-handed angle. Expects radians in -6.2832..6.2832.

---Twists the shape about an axis through the origin.
---@class softvt.TwistSpec
---@field axis "x"|"y"|"z" Axis of the twist.
---@field rate number Angle per length along the axis. Expects a number (rad/m).

---Bends the shape into an arc; the origin stays in place.
---@class softvt.BendSpec
---@field along "x"|"y"|"z" The axis that becomes an arc.
---@field towards "x"|"y"|"z" The axis with the centre of the arc.
---@field curvature number Curvature of the arc. Expects a number (1/m).

---Adds regular ridges to a shape: rings, flutes, screws or spirals.
---@class softvt.RidgesSpec
---@field axis? "x"|"y"|"z" The axis that the ridges run around or along. Default "z".
---@field height number Height from valley to crest; negative for grooves. Expects metres.
---@field count? integer Number of ridges around the axis. Expects a whole number in -1000..1000. Default 0.
---@field pitch? number Distance of ridges along the axis; infinite for flutes. Expects metres above 0. Default inf.
---@field radial_pitch? number Distance of ridges away from the axis; infinite if they do not depend on it. Expects metres above 0. Default inf.
---@field phase? number Phase of the ridges at the origin. Expects radians. Default 0.
---@field sharpness? number 1 is a sine; larger values give narrower ridges. Expects a number in 1..8. Default 1.
---@field mask? softvt.Ramp Weight of their height; 1 everywhere by default.

---A weight that rises smoothly from 0 to 1 along an axis.
---@class softvt.Ramp
---@field axis "x"|"y"|"z" Axis of the coordinate.
---@field from number Coordinate at which the weight is 0. Expects metres.
---@field to number Coordinate at which the weight is 1. Expects metres.

---Adds scattered bumps to a shape (seeds, raisins).
---@class softvt.BumpsSpec
---@field height number Height; negative for pits. Expects metres.
---@field radius number Radius of a bump, at most half the spacing. Expects metres above 0.
---@field spacing number Mean distance of bumps. Expects metres above 0.
---@field seed? integer Seed of the positions of the bumps. Expects a whole number of 0 or more. Default 0.
---@field mask? softvt.Ramp Weight of their height; 1 everywhere by default.

---Gives all or part of the surface another material.
---@class softvt.PaintSpec
---@field material integer Material id: index into the asset's visuals, from 0. Expects a whole number in 0..65535.
---@field region? softvt.Shape Part of the surface inside of this shape; the whole surface by default.

---Adds a soft body. A body that overlaps another or a solid by more than 1 mm is an error.
---@class softvt.WorldSoft
---@field name? string Name of the body in messages. Default "body".
---@field shape softvt.Shape Shape of the body at rest.
---@field body softvt.Soft Material of the body.
---@field friction? softvt.Friction Friction of its surface.
---@field position number[] Position of its frame. Expects a list of 3 numbers (m).
---@field axis_angle? number[] Orientation; none by default. Expects a list of 3 numbers (rad).

---A solid that moves as prescribed (kinematic) or never (static).
---@class softvt.WorldSolid
---@field name? string Name of the solid in messages. Default "solid".
---@field shape softvt.Shape Shape of the solid.
---@field friction? softvt.Friction Friction of its surface.
---@field position number[] Position of its frame. Expects a list of 3 numbers (m).
---@field axis_angle? number[] Orientation; none by default. Expects a list of 3 numbers (rad).

---A gel pad of the robot on a rigid carrier that solid:move_to moves.
---@class softvt.WorldGelPad
---@field name? string Name of the pad in messages. Default "gel pad".
---@field position number[] Position of its apex. Expects a list of 3 numbers (m).
---@field axis_angle? number[] Orientation. Without one, the gel faces +x and its long side is vertical. Expects a list of 3 numbers (rad).

---Holds a part of a soft body on a solid or in the world, where it is now. What moves the solid moves the part. Where it is held, the body does not touch the solid.
---@class softvt.WorldAttach
---@field body softvt.Body The soft body.
---@field region softvt.Shape The part, in the frame of the shape of the body. It may be larger than the body.
---@field to softvt.Solid|"world" The solid that holds the part, or "world".

---Renders the image of a camera, by default third_person.
---@class softvt.Render
---@field camera? string A camera of the scene. Default "third_person".
---@field width? integer Width, pixels; the camera's by default. Expects a whole number in 1..4096.
---@field height? integer Height, pixels; the camera's by default. Expects a whole number in 1..4096.

---Writes a line of text on the image.
---@class softvt.Text
---@field at number[] Left end of its baseline, from the top left. Expects a list of 2 numbers in -100000..100000 (pixels).
---@field size? number Height of the letters. Expects a number (pixels) in 4..200. Default 18.
---@field colour number[] Colour of the letters. Expects a list of 3 numbers (sRGB of 0 to 255).

---Placement of an asset. Give either at or position.
---@class softvt.Place
---@field name string Name in the scene, unique.
---@field asset softvt.Asset Asset of the object.
---@field at? number[] Position x, y; the object rests on the table, or on the object that `on` names. Expects a list of 2 numbers in -1000..1000 (m, world).
---@field position? number[] Position of its origin: its lowest point, on the centre line. Expects a list of 3 numbers in -1000..1000 (m, world).
---@field yaw? number Rotation about the vertical. Expects radians in -6.2832..6.2832. Default 0.
---@field on? string Scene name of the object or part (cabinet.top_drawer) that it rests on (with at).
---@field scale? number Size relative to that of the asset. Its material stays, and its mass follows as the cube. Expects a number in 0.1..10. Default 1.
---@field joints? table<string, number> Start values of an articulated object's joints by part; 0, or the nearest limit, by default.

---A camera. Give either look_at or quaternion.
---@class softvt.NewCamera
---@field name string Name, unique; also that of its image stream.
---@field mount? "world"|"hand" Frame that the camera is fixed to; hand is panda_hand. Default "world".
---@field position number[] Position of its centre. Expects a list of 3 numbers in -100..100 (m, frame of the mount).
---@field look_at? number[] A point in the middle of the image. Expects a list of 3 numbers in -100..100 (m, frame of the mount).
---@field up? number[] Upward direction in the image (with look_at); z by default. Expects a list of 3 numbers (frame of the mount).
---@field quaternion? number[] Orientation: the camera looks along its −z axis, and +y is up in the image. Expects a list of 4 numbers (w, x, y, z, frame of the mount).
---@field fovy? number Vertical field of view. Expects radians in 0.01..2.8. Default 0.8.
---@field near? number Distance of the nearest visible point. Expects metres in 0.0001..100. Default 0.01.
---@field far? number Distance of the farthest visible point. Expects metres in 0.001..10000. Default 20.
---@field width? integer Width of the image, pixels. Expects a whole number in 1..4096. Default 224.
---@field height? integer Height of the image, pixels. Expects a whole number in 1..4096. Default 224.

---Returns the distance between a hand at a pose and the nearest object, m, and the name of that object. The distance is at most 0.2 and negative inside.
---@class softvt.Clearance
---@field width? number Distance of the gels. Expects metres in 0..0.08. Default 0.08.
---@field ignore? string[] Scene names of objects that it may touch.

---Options of a motion of the arm.
---@class softvt.MotionOptions
---@field speed? number Largest speed of the tool. Expects a number (m/s) in above 0..6.8. Default 0.25.
---@field angular_speed? number Largest angular speed of the tool. Expects a number (rad/s) in above 0..10. Default 1.5.
---@field closure? number Closure at the end; by default it stays. Expects a number in 0..1.

---Options of closing and opening.
---@class softvt.RateOptions
---@field rate? number Rate of the gripper: 1 is the whole stroke in a second, 5 the speed of the fingers. Expects a number (1/s) in 0.001..5. Default 0.5.

---Options of closing on an object.
---@class softvt.GraspOptions
---@field rate? number Rate of the gripper: 1 is the whole stroke in a second, 5 the speed of the fingers. Expects a number (1/s) in 0.001..5. Default 0.5.
---@field width? number Measured distance of the gels at which closing stops. A tactile servo ignores it. Expects metres in 0..0.08.
---@field force? number Mean normal force per pad at which closing stops. A tactile servo ignores it. Expects a number (N) above 0.

---Options of releasing an object.
---@class softvt.ReleaseOptions
---@field rate? number Rate of the gripper: 1 is the whole stroke in a second, 5 the speed of the fingers. Expects a number (1/s) in 0.001..5. Default 0.5.
---@field closure? number Closure at the end. Expects a number in 0..1. Default 0.

---The goal of a task.
---@alias softvt.Goal softvt.On|softvt.Inside|softvt.Stacked|softvt.Opened|softvt.Closed|softvt.Turned|softvt.Near|softvt.Beside|softvt.Upright|softvt.Predicate|softvt.All|softvt.Any|softvt.None|softvt.Sequence

---Settings; those that are left out keep their values. docs/settings.md lists all.
---@class softvt.Settings
---@field physics? softvt.Settings.physics
---@field robot? softvt.Settings.robot
---@field criteria? softvt.Settings.criteria
---@field tactile? softvt.Settings.tactile
---@field cameras? softvt.Settings.cameras

---Settings; those that are left out keep their values. docs/settings.md lists all.
---@class softvt.Settings.physics
---@field dt? number Time step. Control runs at 20 Hz independently of it, so it must divide 0.05 s in the benchmark. Limits and grip windows are calibrated with the default. Expects a number in 0.0001..0.05 (s). Default 0.016666666666666666.
---@field mesh_refinement? number Factor on the number of voxels along each edge of soft bodies, which shows how a result depends on the mesh. Expects a number in 0.25..4. Default 1.
---@field rayleigh_mass? number Mass-proportional Rayleigh damping of soft bodies (α, as air drag). The paper's engine uses 2.5. Expects a number in 0..1000 (1/s). Default 0.
---@field rayleigh_stiffness? number Stiffness-proportional Rayleigh damping (β) of soft bodies whose material has no loss factor. Implicit Euler adds its step. Equilibria do not depend on it. Expects a number in 0..1 (s). Default 0.005.
---@field average_acceleration? boolean True to integrate soft bodies by average acceleration, which adds next to no damping; false for implicit Euler, whose step damps motion. Expects true or false. Default true.
---@field dissipation_time? number Dissipation time scale τ_d of contact springs, s (Castro et al. 2022). A surface that recedes faster than the springs relax is released; the value is small compared with `dt`, so that friction does not lift a sliding surface. Expects a number in 0..1 (s). Default 0.005.
---@field rigid_modulus? number Normal contact stiffness per area of nearly rigid colliders, Pa/m: near rigid for Young's moduli up to 1 MPa. Expects a number in above 0..1000000000000 (Pa/m). Default 1e9.
---@field shear_ratio? number Tangential over normal contact stiffness. Mindlin (1949) gives 0.5 to 0.8 for solids; creep does not depend on it. Expects a number in above 0..10. Default 0.5.
---@field margin? number Gap below which a sample becomes a contact point. A sample that will reach the surface within 1.5 steps becomes one as well. Expects a number in above 0..0.01 (m). Default 0.0002.
---@field sleep_speed? number Speed below which a body may fall asleep. Expects a number in 0..1 (m/s). Default 0.0001.
---@field sleep_delay? number Time for which a body must be that slow before it sleeps. Expects a number in above 0..60 (s). Default 0.5.
---@field sleeping? boolean True if bodies may fall asleep at all. Expects true or false. Default true.
---@field max_inverted_time? number Longest time for which an element may be inverted before the run is invalid. Expects a number in 0..60 (s). Default 0.1.
---@field max_speed? number Largest speed of a valid state, m/s: far above that of a gripper (0.2 m/s), an arm, or a fall onto a table. Expects a number in above 0..1000 (m/s). Default 100.

---Settings; those that are left out keep their values. docs/settings.md lists all.
---@class softvt.Settings.robot
---@field arm? softvt.Settings.robot.arm
---@field gripper? softvt.Settings.robot.gripper
---@field pads? softvt.Settings.robot.pads
---@field ik? softvt.Settings.robot.ik
---@field width_sensor? softvt.Settings.robot.width_sensor
---@field latency? number Delay between a command and the robot's response, control steps of 0.05 s. Expects a whole number in 0..100 (control steps). Default 0.
---@field disturbance? softvt.Settings.robot.disturbance

---Settings; those that are left out keep their values. docs/settings.md lists all.
---@class softvt.Settings.robot.arm
---@field kp? number Stiffness. Expects a number in above 0..1000000 (N m/rad). Default 8000.
---@field kd? number Damping. Expects a number in above 0..100000 (N m s/rad). Default 800.

---Settings; those that are left out keep their values. docs/settings.md lists all.
---@class softvt.Settings.robot.gripper
---@field kp? number Stiffness. Expects a number in above 0..1000000 (N/m). Default 2000.
---@field kd? number Damping. Expects a number in above 0..100000 (N s/m). Default 100.
---@field effort? number Largest force per finger. The real hand holds 70 N continuously (Franka Emika, Hand data sheet); the paper's simulator has 200 N. Expects a number in above 0..500 (N). Default 70.
---@field speed? number Speed at which the target of each finger moves. Expects a number in above 0..2 (m/s). Default 0.2.
---@field finger_mass? number Mass of each finger with its sensor. Expects a number in above 0..10 (kg). Default 0.1.

---Settings; those that are left out keep their values. docs/settings.md lists all.
---@class softvt.Settings.robot.pads
---@field static_mu? number Friction coefficient while the pad sticks. Expects a number in 0..100. Default 1.5.
---@field dynamic_mu? number Dynamic friction coefficient, not above the static one. Expects a number in 0..100. Default 1.2.

---Settings; those that are left out keep their values. docs/settings.md lists all.
---@class softvt.Settings.robot.ik
---@field lambda? number Damping λ of the least squares, in the mixed unit (m and rad per rad) of the Jacobian's singular values. Larger values are slower and more robust near singularities. Expects a number in above 0..10. Default 0.01.
---@field posture_gain? number Share of the way to the rest posture that the null space covers per control step, 0..=1. Expects a number in 0..1. Default 0.

---Settings; those that are left out keep their values. docs/settings.md lists all.
---@class softvt.Settings.robot.width_sensor
---@field resolution? number Step of the measured width; 0 for none. Expects a number in 0..0.01 (m). Default 0.0004.
---@field offset? number Standard deviation of the error that is constant in an episode. Expects a number in 0..0.01 (m). Default 0.00025.
---@field noise? number Standard deviation of the noise, new in every control step. Expects a number in 0..0.01 (m). Default 0.

---Settings; those that are left out keep their values. docs/settings.md lists all.
---@class softvt.Settings.robot.disturbance
---@field position? number Standard deviation of the position along each axis. Expects a number in 0..0.05 (m). Default 0.
---@field rotation? number Standard deviation of the rotation about each axis. Expects a number in 0..0.5 (rad). Default 0.
---@field duration? number Time after which the correlation of the offset has fallen to 1/e. Expects a number in above 0..1000 (s). Default 0.5.

---Settings; those that are left out keep their values. docs/settings.md lists all.
---@class softvt.Settings.criteria
---@field touch_force_n? number Minimum force that counts as contact, of a pad, another part of the robot or a support. Expects a number in 0..100 (N). Default 0.001.
---@field lift_height_m? number Minimum rise of a body's lowest point above its settled height that counts as lifted. Expects a number in 0..0.5 (m). Default 0.005.
---@field lost_contact_s? number Time without pad contact after which a grasp may count as lost, s (0.15 s: three control steps). Expects a number in 0..60 (s). Default 0.15.
---@field lost_fall_m? number Fall relative to the hand beyond which a lost grasp is a drop. Expects a number in 0..0.5 (m). Default 0.02.
---@field free_fall_m? number Length of a free fall beyond which it is a drop, before or after the release. Expects a number in 0..0.5 (m). Default 0.05.
---@field release_margin_m? number Excess of the commanded over the measured gripper width that counts as a release command. Expects a number in 0..0.5 (m). Default 0.005.
---@field slip_m? number Largest allowed distance that the object slides along a pad while the pads alone carry it, m: NoSlip, which is not part of NoDrop. Expects a number in 0..0.5 (m). Default 0.002.
---@field require_no_slip? boolean True if Safety Success needs NoSlip. Expects true or false. Default false.
---@field gentle_ratio? number Largest grip ratio of a gentle grip. Expects a number in 0..1000. Default 2.
---@field support_share? number Minimum share of the target's weight that the goal must carry, 0 to 1. Expects a number in 0..1. Default 0.5.
---@field leave_margin_m? number Distance of the centre beyond the goal's edge at which a placed object has left the goal. Expects a number in 0..0.5 (m). Default 0.005.
---@field goal_v1_on_m? number Horizontal and vertical distance within which SoftVTBench's released code counts an object as "on". Expects a number in 0..2 (m). Default 0.1.
---@field goal_v1_in_m? number Horizontal and vertical distance within which SoftVTBench's released code counts an object as "in". Expects a number in 0..2 (m). Default 0.2.

---Settings; those that are left out keep their values. docs/settings.md lists all.
---@class softvt.Settings.tactile
---@field gel? softvt.Settings.tactile.gel
---@field view? softvt.Settings.tactile.view
---@field optics? table Model of the colour image. Expects polynomial, or { model = "taxim", tables = folder }. Default polynomial.
---@field shadows? boolean True to draw cast shadows; with the `polynomial` optics only. Expects true or false. Default false.
---@field markers? softvt.Settings.tactile.markers Model of the marker motion. Expects elastic, or fots with the constants below. Default elastic.
---@field wear? softvt.Settings.tactile.wear

---Settings; those that are left out keep their values. docs/settings.md lists all.
---@class softvt.Settings.tactile.gel
---@field shear_modulus? number Shear modulus. 0.145 MPa: twice the C10 identified on a GelSight Mini (Helmut et al., arXiv 2411.03315). Expects a number in 10000..1000000000 (Pa). Default 145000.
---@field poisson? number Poisson's ratio. Expects a number in 0..0.499. Default 0.475.
---@field cell? number Edge of a grid cell. Expects a number in 0.0001..0.0005 (m). Default 0.0004.

---Settings; those that are left out keep their values. docs/settings.md lists all.
---@class softvt.Settings.tactile.view
---@field pitch? number Edge of a pixel on the plane of the apex. 0.0634 mm at 320×240 (GelSight's own figure). Expects a number in 0.00001..0.0002 (m). Default 0.0000634.
---@field lens? number Distance of the pinhole from the apex. Expects a number in 0.005..1 (m). Default 0.026.

---Settings; those that are left out keep their values. docs/settings.md lists all.
---@class softvt.Settings.tactile.markers
---@field model? string Name of the model; the constants are its own.
---@field dilate? number Decay of the dilation. Expects a number in 0..1 (1/px²). Default 0.00125.
---@field shear? number Decay of the shear. Expects a number in 0..1 (1/px²). Default 0.00021.
---@field twist? number Decay of the twist. Expects a number in 0..1 (1/px²). Default 0.00038.
---@field scale? number Scale of the image, pixels per millimetre. Expects a number in 1..1000 (px/mm). Default 19.58.
---@field height_factor? number Factor on the depths in mm: 1 in FOTS, 0.1 in the port that SoftVTBench uses. Expects a number in 0..100. Default 0.1.

---Settings; those that are left out keep their values. docs/settings.md lists all.
---@class softvt.Settings.tactile.wear
---@field noise_px? number Standard deviation of the noise of each marker coordinate in each image. Expects a number in 0..20 (px). Default 0.
---@field offset_px? number Standard deviation of the constant offset of each marker coordinate. Expects a number in 0..20 (px). Default 0.
---@field gain? number Factor on the displacements of the markers and on the changes of the image. Expects a number in 0..10. Default 1.
---@field dead_share? number Share of the markers that do not follow the gel. Expects a number in 0..1. Default 0.
---@field image_noise? number Standard deviation of the noise of each colour value (0 to 255) in each image. Expects a number in 0..128 (of 255). Default 0.

---Settings; those that are left out keep their values. docs/settings.md lists all.
---@class softvt.Settings.cameras
---@field width? number Width, pixels; `None` for that of the scene. Expects a whole number in 1..4096 (pixels). Default that of the scene.
---@field height? number Height, pixels; `None` for that of the scene. Expects a whole number in 1..4096 (pixels). Default that of the scene.

---A solid. Methods return a new shape and leave this one as it is.
---@class softvt.Shape
local Shape = {}

---@nodiscard
---Moves the shape by an offset, m.
---@param x number
---@param y number
---@param z number
---@return softvt.Shape
function Shape:translate(x, y, z) end

---@nodiscard
---Stretches the shape by factors along x, y and z, or by a single factor along all axes.
---@param x number
---@param y? number
---@param z? number
---@return softvt.Shape
function Shape:scale(x, y, z) end

---@nodiscard
---Grows the shape by a radius (m), which rounds convex edges.
---@param radius number
---@return softvt.Shape
function Shape:round(radius) end

---@nodiscard
---Keeps the wall of this thickness (m) below the surface.
---@param wall number
---@return softvt.Shape
function Shape:shell(wall) end

---@nodiscard
---Joins the shape and another one.
---@param other softvt.Shape
---@return softvt.Shape
function Shape:union(other) end

---@nodiscard
---Keeps the part that lies in both shapes.
---@param other softvt.Shape
---@return softvt.Shape
function Shape:intersect(other) end

---@nodiscard
---Cuts another shape out of this one; blend (m) rounds the edge.
---@param cut softvt.Shape
---@param blend? number
---@return softvt.Shape
function Shape:subtract(cut, blend) end

---@nodiscard
---Joins two shapes with a fillet of width blend (m).
---@param other softvt.Shape
---@param blend number
---@return softvt.Shape
function Shape:smooth_union(other, blend) end

---Returns the lowest and the highest corner of the bounding box, m.
---@return number[]
---@return number[]
function Shape:bounds() end

---Returns the volume, m³.
---@return number
function Shape:volume() end

---@nodiscard
---Moves the shape so that its lowest point is at z = 0 and its centre on the z axis, as assets require.
---@return softvt.Shape
function Shape:grounded() end

---@nodiscard
---Rotates the shape about an axis through the origin.
---@param spec softvt.RotateSpec
---@return softvt.Shape
function Shape:rotate(spec) end

---@nodiscard
---Twists the shape about an axis through the origin.
---@param spec softvt.TwistSpec
---@return softvt.Shape
function Shape:twist(spec) end

---@nodiscard
---Bends the shape into an arc; the origin stays in place.
---@param spec softvt.BendSpec
---@return softvt.Shape
function Shape:bend(spec) end

---@nodiscard
---Adds regular ridges to a shape: rings, flutes, screws or spirals.
---@param spec softvt.RidgesSpec
---@return softvt.Shape
function Shape:ridges(spec) end

---@nodiscard
---Adds scattered bumps to a shape (seeds, raisins).
---@param spec softvt.BumpsSpec
---@return softvt.Shape
function Shape:bumps(spec) end

---@nodiscard
---Gives all or part of the surface another material.
---@param spec softvt.PaintSpec
---@return softvt.Shape
function Shape:paint(spec) end

---A weight between 0 and 1 at every point of a surface, for the layers of a visual. A mask never changes; methods return new masks.
---@class softvt.Mask
local Mask = {}

---@nodiscard
---Returns the product of two masks: 1 where both are.
---@param other softvt.Mask
---@return softvt.Mask
function Mask:intersect(other) end

---@nodiscard
---Returns 1 minus the mask.
---@return softvt.Mask
function Mask:inverted() end

---The mechanics alone: soft bodies among solids that are fixed or move as prescribed.
---@class softvt.World
local World = {}

---Adds a soft body. A body that overlaps another or a solid by more than 1 mm is an error.
---@param spec softvt.WorldSoft
---@return softvt.Body
function World:soft(spec) end

---Adds a solid that solid:move_to moves.
---@param spec softvt.WorldSolid
---@return softvt.Solid
function World:kinematic(spec) end

---Adds a solid that never moves.
---@param spec softvt.WorldSolid
---@return softvt.Solid
function World:static(spec) end

---Adds a gel pad of the robot, with the shape and the default contact law of its fingers, on a carrier that solid:move_to moves. Its frame is at the apex of the gel, which faces along x.
---@param spec softvt.WorldGelPad
---@return softvt.Solid
function World:gel_pad(spec) end

---Holds a part of a soft body on a solid or in the world, where it is now. What moves the solid moves the part. Where it is held, the body does not touch the solid.
---@param spec softvt.WorldAttach
---@return softvt.Attachment
function World:attach(spec) end

---Makes one time step. Returns false and the reason if the state is invalid then; a further step is an error.
---@return boolean
---@return string?
function World:step() end

---Returns the time step, s.
---@return number
function World:dt() end

---Returns the simulated time, s.
---@return number
function World:time() end

---Returns the mean and the largest number of Newton iterations per step.
---@return number
---@return integer
function World:newton() end

---Returns the sum of kinetic, elastic and potential energy, J.
---@return number
function World:energy() end

---Starts a phase: CPU time of later steps counts for it.
---@param name string
function World:phase(name) end

---Prints CPU time per simulated time, by phase, to standard error.
function World:report_timing() end

---A soft body of a world.
---@class softvt.Body
local Body = {}

---Returns the centre of mass, m.
---@return number[]
function Body:centre() end

---Returns the velocity of the centre of mass, m/s.
---@return number[]
function Body:velocity() end

---Returns the speed of the fastest node, m/s.
---@return number
function Body:speed() end

---Returns the mass, kg.
---@return number
function Body:mass() end

---Returns the least det F of a filled element: 0 or less is inverted, nil if no element is filled.
---@return number?
function Body:min_det_f() end

---Returns true if the body sleeps.
---@return boolean
function Body:asleep() end

---Returns the deformation against the reference shape.
---@return softvt.Deformation
function Body:deformation() end

---Returns the strain up to which its material is stable and undamaged: the smaller of collapse_strain and damage_strain; nil if it states none.
---@return number?
function Body:stable_strain() end

---Returns the compressive strain that `percent` of the volume stays below: 1 − σ_min(F) at the Gauss points, weighted by volume. 95 is usual; a number between 0 and 1 is most likely a share, and an error. With a `length`, of 1 to 8 voxels, the strain of a point is its average within that distance.
---@param percent number
---@param length? number
---@return number
function Body:strain_percentile(percent, length) end

---Returns the share of the volume, %, with a compressive strain above `strain`.
---@param strain number
---@return number
function Body:volume_beyond_pct(strain) end

---Returns how the body lies if it has tilted by 5° or more from its modelled shape, else nil.
---@return softvt.Lying?
function Body:lying() end

---Returns the size of the bounding box of the nodes, m.
---@return number[]
function Body:extent() end

---Sets the reference shape of deformation: the rest shape (at the start) or the present one.
---@param which "rest"|"now"
function Body:set_reference(which) end

---Returns the normal force of a solid on the body, N.
---@param solid softvt.Solid
---@return number
function Body:force(solid) end

---Returns the tangential force of a solid on the body, N.
---@param solid softvt.Solid
---@return number
function Body:shear(solid) end

---Returns the distance that the contact patch has slid on a solid, mm.
---@param solid softvt.Solid
---@return number
function Body:slip_mm(solid) end

---Returns the share of the contact patch's samples that slip, 0..1.
---@param solid softvt.Solid
---@return number
function Body:slipping(solid) end

---A solid of a world.
---@class softvt.Solid
local Solid = {}

---Prescribes the pose after the next step: position, m, and orientation as axis-angle, rad (none by default).
---@param position number[]
---@param axis_angle? number[]
function Solid:move_to(position, axis_angle) end

---A part of a soft body that a solid or the world holds.
---@class softvt.Attachment
local Attachment = {}

---Returns the force that holds the body, N, in the world frame.
---@return number[]
function Attachment:force() end

---Returns the number of nodes that are held.
---@return integer
function Attachment:nodes() end

---Deformation of a body against its reference shape, in percent of the diagonal of its bounding box along its own axes.
---@class softvt.Deformation
---@field rms_pct number D: root mean square of the displacement over the volume.
---@field max_pct number Largest displacement of a node.
---@field v1_rms_pct number D as SoftVTBench's released code defines it: all nodes alike, the box along the axes of the world.
local Deformation = {}

---A settled scene with the robot.
---@class softvt.Simulation
local Simulation = {}

---Runs an expert to its end. Returns false and the reason if it gave up, as for a pose out of reach, or the physics failed.
---@param expert fun(arm: softvt.Arm, scene: softvt.SceneState)
---@return boolean
---@return string?
function Simulation:drive(expert) end

---Holds the last command for a time. Returns false and the reason if the physics failed.
---@param seconds number
---@return boolean
---@return string?
function Simulation:wait(seconds) end

---Returns measurements of an object.
---@param object string
---@return softvt.Measurements
function Simulation:measure(object) end

---Renders the image of a camera, by default third_person.
---@param spec? softvt.Render
---@return softvt.Image
function Simulation:render(spec) end

---Returns the reading of a finger's tactile sensor, with the true force on its gel.
---@param side "left"|"right"
---@return softvt.TactileReading
function Simulation:tactile(side) end

---Returns the time since settling, s.
---@return number
function Simulation:time() end

---Returns the pose of the tool centre point in the world frame: position, m, and orientation as axis-angle, rad.
---@return number[]
---@return number[]
function Simulation:tool() end

---Measurements of an object. Fields that do not apply to it are nil.
---@class softvt.Measurements
---@field width_m number? Measured distance of the gels, m.
---@field height_m number? Rise of the object's centre since settling, m.
---@field speed number? Speed; of a soft body that of its fastest node, m/s.
---@field asset string Name of its asset.
---@field fingerprint string Fingerprint of its asset.
---@field joint number? Joint value of a part, m or rad.
---@field joints table<string, number> Joint values of an articulated object by part, m or rad.
---@field pad_force number[] Sum of the normal forces at the contact points of the left and the right gel pad on the object, N; see arm.force.
---@field slip_mm number[]? Distance that a movable object has slid on the left and the right pad, mm.
---@field d_pct number? Deformation D of a soft body, %.
---@field d_peak_pct number? Largest D since settling, %.
---@field d_peak_v1_pct number? The same by SoftVTBench's definition of D, %.
---@field min_det_f number? Minimum det F of a filled element of a soft body.
---@field asleep boolean? True if a soft body sleeps.
local Measurements = {}

---The tactile sensor of a finger, with the true force on its gel; docs/tactile.md draws its frames.
---@class softvt.TactileReading
---@field image softvt.Image Colour image, 320 × 240.
---@field dots softvt.Image The image with its markers as dots.
---@field arrows softvt.Image The image with the displacements of its markers as lengthened arrows.
---@field initial number[][] Positions of the 99 markers on the untouched gel, px, row by row.
---@field present number[][] Their present positions, px.
---@field markers softvt.Markers The markers with the measures of their displacements.
---@field force number[] True force on the gel, N, pad frame: the vector sum over its contact points, friction included. A pressing body makes z negative.
---@field depth_mm number Largest depth of the indentation, mm.
local TactileReading = {}

---The upright box, along its narrowest side, about a soft body that has tilted.
---@class softvt.Lying
---@field tilt number Angle between the vertical and the z axis of its shape, rad.
---@field centre number[] Centre of the box, m.
---@field size number[] Edge lengths of the box, longer horizontal side first, m.
---@field yaw number Rotation of the box about the vertical, rad.
local Lying = {}

---One end of the safe window of an asset.
---@class softvt.WindowEnd
---@field width_mm number? Width between the gels, mm; nil if the scans do not reach it.
---@field force_n number? Force per pad, N; nil if the sweep does not reach the width.
local WindowEnd = {}

---The safe window of an asset.
---@class softvt.SafeWindow
---@field loose softvt.WindowEnd Loose end: the widest width at which every hold trial held.
---@field tight softvt.WindowEnd Tight end: the widest width at which the deformation reaches τ, pressed or carried.
---@field extent_mm number? Extent of the window, mm; nil if it is empty.
local SafeWindow = {}

---Results of a calibration.
---@class softvt.Envelope
---@field protocol string Protocol of the sweep: "press" or "hand".
---@field window softvt.SafeWindow Loose and tight end of the safe window.
---@field width_contact_mm number? Widest width at which both pads touched, mm.
---@field width_at_d_ref_mm number? Width at D_ref, mm.
---@field tau number? Deformation limit τ, %.
---@field d_ref number? Reference deformation D_ref, %.
---@field carried_d number? Smallest peak deformation of the object while it was carried in a hold trial, %.
---@field stable_strain number? Stable strain of the material.
---@field censored string? Why the sweep ended before the stable strain; nil if it did not.
---@field text string The envelope in three lines.
---@field plot string A plot of deformation over width as SVG.
---@field sweep string The rows of the sweep as JSON lines.
---@field json string The calibration file as JSON text.
---@field table table The same as a table.
local Envelope = {}

---A grip at rest.
---@class softvt.Grip
---@field width number Distance of the gels, m.
---@field force number Normal force per pad, N.
local Grip = {}

---The safe window of an instance.
---@class softvt.InstanceWindow
---@field loose softvt.Grip The loosest grip that holds.
---@field tight softvt.Grip The tightest grip whose carried object stays within τ; that of the loose end if none does.
---@field contact number Distance of the gels at first contact, m.
---@field carried number D that the weight of the carried object causes, as a share of τ.
---@field tau number Deformation limit τ of the instance, %.
local InstanceWindow = {}

---An instance of an asset, with the fields that a grasp needs of an object.
---@class softvt.InstanceState
---@field asset string Name of its asset.
---@field size number[] Edge lengths of its bounding box at rest, m.
---@field scale number Size relative to that of its asset.
---@field youngs_factor number Young's modulus relative to that of its asset.
---@field density_factor number Density relative to that of its asset.
---@field strain_factor number Stable strain relative to that of its asset.
---@field coating number? Static friction of its coating; nil without one.
---@field draws integer Number of draws until an instance could be kept.
---@field hints table<string, number> Numbers of its asset for experts, as those of an object.
local InstanceState = {}

---An image of 8-bit sRGB pixels. Regions are x, y, width, height in pixels from the top left.
---@class softvt.Image
---@field width integer Width, pixels.
---@field height integer Height, pixels.
local Image = {}

---Returns the mean red, green and blue of a region, or of the whole image, 0..255.
---@param region? number[]
---@return number[]
function Image:mean(region) end

---Returns red, green and blue of a pixel, 0..255; the top left pixel is 0, 0.
---@param x integer
---@param y integer
---@return number[]
function Image:pixel(x, y) end

---@nodiscard
---Returns a region as an image of its own.
---@param region number[]
---@return softvt.Image
function Image:crop(region) end

---@nodiscard
---Returns the image in another size.
---@param width integer
---@param height integer
---@return softvt.Image
function Image:resize(width, height) end

---Copies another image onto this one, with its top left pixel at x, y.
---@param other softvt.Image
---@param x number
---@param y number
function Image:paste(other, x, y) end

---Writes a line of text on the image.
---@param text string
---@param style softvt.Text
function Image:text(text, style) end

---An immutable pose in the world frame.
---@class softvt.Pose
---@field x number Position along x, m.
---@field y number Position along y, m.
---@field z number Position along z, m.
---@field position number[] Position x, y, z, m.
---@field quaternion number[] Orientation as quaternion w, x, y, z with w ≥ 0.
local Pose = {}

---@nodiscard
---Returns the pose moved by an offset in the world frame, m.
---@param offset number[]
---@return softvt.Pose
function Pose:translated(offset) end

---@nodiscard
---Returns the same orientation at another position, m.
---@param position number[]
---@return softvt.Pose
function Pose:at(position) end

---@nodiscard
---Returns the same position, rotated by an angle about the world's vertical, rad.
---@param angle number
---@return softvt.Pose
function Pose:rotated(angle) end

---@nodiscard
---Returns a pose between this one (at a share of 0) and another (at 1).
---@param other softvt.Pose
---@param share number
---@return softvt.Pose
function Pose:interpolate(other, share) end

---Returns the position in the world of a point of this pose's frame, m.
---@param point number[]
---@return number[]
function Pose:transform(point) end

---Returns the distance to another pose, m, and the angle between the orientations, rad.
---@param other softvt.Pose
---@return number
---@return number
function Pose:distance(other) end

---A named stream of random numbers, determined by suite, layout, episode, seed and split.
---@class softvt.Rng
local Rng = {}

---@nodiscard
---Returns another stream, from its start. Draws from one stream do not change those from another.
---@param name "layout"|"arm"|"material"|"size"|"colour"|"light"|"camera"|"sensor"|"expert"|"script"|"policy"
---@return softvt.Rng
function Rng:stream(name) end

---Returns a number uniformly distributed from low (included) to high (excluded).
---@param low number
---@param high number
---@return number
function Rng:uniform(low, high) end

---Returns a normally distributed number; sigma is the standard deviation.
---@param mean number
---@param sigma number
---@return number
function Rng:normal(mean, sigma) end

---Returns a whole number from low to high, both included.
---@param low integer
---@param high integer
---@return integer
function Rng:int(low, high) end

---Returns one entry of a list.
---@param list any[]
---@return any
function Rng:choice(list) end

---Returns a copy of a list in random order.
---@param list any[]
---@return any[]
function Rng:shuffle(list) end

---The scene that a layout or a shift builds.
---@class softvt.Scene
---@field objects softvt.Object[] The placed objects, in order.
---@field goal_object softvt.Object? The object of the task's goal, in shifts; nil in layouts, which several tasks may share.
---@field light softvt.Light Key light and sky.
---@field base number[] Position of the robot base. Expects a list of 3 numbers in -1000..1000 (m, world).
---@field start_q number[] Joint angles of the arm at the start, within its limits. Expects a list of 7 numbers (rad).
---@field prompt string The instruction of the task, in shifts; nil in layouts.
---@field gravity number[] Acceleration of gravity. Expects a list of 3 numbers in -100..100 (m/s², world).
---@field workspace_min number[] Lowest corner of the workspace. Expects a list of 3 numbers (m, world).
---@field workspace_max number[] Highest corner of the workspace. Expects a list of 3 numbers (m, world).
local Scene = {}

---Adds an object: `scene:add { name = "left", asset = bun, at = { 0.1, -0.2 }, yaw = 0.5 }`.
---@param spec softvt.Place
function Scene:add(spec) end

---Returns a placed object by name.
---@param name string
---@return softvt.Object
function Scene:object(name) end

---Returns the horizontal distance from a point to the nearest object, taken as an upright cylinder about its origin, m; negative inside of one. Surfaces at or below z = 0 and scenery do not count.
---@param x number
---@param y number
---@return number
function Scene:distance_to_objects(x, y) end

---Returns a camera by name; every scene has third_person and wrist.
---@param name string
---@return softvt.Camera
function Scene:camera(name) end

---Adds a camera and returns it.
---@param spec softvt.NewCamera
---@return softvt.Camera
function Scene:add_camera(spec) end

---The light of a scene: a key light and a sky.
---@class softvt.Light
---@field direction number[] Direction to the key light. Expects a list of 3 numbers (world, any length).
---@field colour number[] Colour of the key light. Expects a list of 3 numbers in 0..20 (linear RGB).
---@field strength number Strength of the key light; 1 shows a white surface at full value. Expects a number in 0..1000.
---@field softness number Half of the angle under which the key light is seen; larger values give softer shadows. Expects radians in 0..0.5.
---@field sky_zenith number[] Light from straight above. Expects a list of 3 numbers in 0..20 (linear RGB).
---@field sky_horizon number[] Light from the horizon, and the background. Expects a list of 3 numbers in 0..20 (linear RGB).
---@field sky_ground number[] Light from straight below. Expects a list of 3 numbers in 0..20 (linear RGB).
---@field sky_strength number Factor on the sky. Expects a number in 0..1000.
---@field exposure number Factor on the whole image. Expects a number in above 0..1000.
local Light = {}

---A pinhole camera of a scene.
---@class softvt.Camera
---@field name string Name in the scene.
---@field mount "world"|"hand" Frame that the camera is fixed to.
---@field position number[] Position of its centre. Expects a list of 3 numbers in -100..100 (m, frame of the mount).
---@field quaternion number[] Orientation: the camera looks along its −z axis, and +y is up in the image. Expects a list of 4 numbers (w, x, y, z, frame of the mount).
---@field fovy number Vertical field of view. Expects radians in 0.01..2.8.
---@field near number Distance of the nearest visible point. Expects metres in 0.0001..100.
---@field far number Distance of the farthest visible point. Expects metres in 0.001..10000.
---@field width integer Width of the image, pixels. Expects a whole number in 1..4096.
---@field height integer Height of the image, pixels. Expects a whole number in 1..4096.
local Camera = {}

---Turns the camera to a point; up (z by default) is the upward direction in the image. Both are in the frame of the mount.
---@param point number[]
---@param up? number[]
function Camera:look_at(point, up) end

---The base material of a visual of a placed object. Its layers stay as they are.
---@class softvt.Material
---@field albedo number[] Colour of the base. Expects a list of 3 numbers in 0..1 (linear RGB).
---@field roughness number Roughness: 0 is a mirror, 1 is chalk. Expects a number in 0..1.
---@field metalness number Metalness: 1 is bare metal. Expects a number in 0..1.
local Material = {}

---A placed object. Numbers of its material are nil where the body has none: youngs_pa and poisson belong to soft bodies, density to soft and rigid ones.
---@class softvt.Object
---@field name string Name in the scene.
---@field asset string Name of its asset.
---@field materials softvt.Material[] The base materials of its visuals, by material id.
---@field joints table<string, number> Start values of its joints by part, m or rad.
---@field position number[] Position of its origin: its lowest point, on the centre line. Expects a list of 3 numbers in -1000..1000 (m, world).
---@field yaw number Rotation about the vertical. Expects radians in -6.2832..6.2832.
---@field scale number Size relative to that of its asset. Material numbers stay, and the mass follows as the cube. Expects a number in 0.1..10.
---@field density number Density of a soft or rigid body. Expects a number (kg/m³) above 0.
---@field youngs_pa number Young's modulus of a soft body. Expects pascals above 0.
---@field poisson number Poisson's ratio of a soft body. Expects a number in 0..below 0.5.
---@field static_mu number Static coefficient of friction. Expects a number in 0..10.
---@field dynamic_mu number Dynamic coefficient of friction. Expects a number in 0..10.
---@field coating number Static coefficient of a coating (flour, oil, glaze), which is that of every pair with this object; the dynamic one is 0.8 of it. Nil without a coating. Expects a number in above 0..10.
local Object = {}

---Returns the mass of a soft or rigid body, of one moving part of an articulated object, or of all its moving parts, kg; nil for what never moves.
---@param part? string
---@return number?
function Object:mass(part) end

---Multiplies the density of a soft or rigid body, or of every moving part. Static objects are unchanged.
---@param factor number
function Object:scale_mass(factor) end

---The true state of the scene at this control step, as an expert gets it.
---@class softvt.SceneState
local SceneState = {}

---Returns the state of an object.
---@param name string
---@return softvt.ObjectState
function SceneState:object(name) end

---Returns the state of a part of an articulated object.
---@param object string
---@param part string
---@return softvt.ObjectState
function SceneState:part(object, part) end

---Returns the states of all objects, in the order of the scene.
---@return softvt.ObjectState[]
function SceneState:objects() end

---Returns the distance between a hand at a pose and the nearest object, m, and the name of that object. The distance is at most 0.2 and negative inside.
---@param pose softvt.Pose
---@param options? softvt.Clearance
---@return number
---@return string?
function SceneState:clearance(pose, options) end

---The true state of an object at one moment.
---@class softvt.ObjectState
---@field name string Name in the scene.
---@field asset string Name of its asset.
---@field centre number[] Centre of its bounding box, world frame, m.
---@field size number[] Edge lengths of its bounding box at rest, m: along the axes of its shape, or, if it has tilted by 5° or more while it settled, of the upright box about it as it lay then, longer horizontal side first.
---@field scale number Size relative to that of its asset. `size` and hints in metres are those of the object itself.
---@field youngs_factor number? Young's modulus relative to that of its asset; nil unless soft.
---@field density_factor number? Density relative to that of its asset; nil unless soft or rigid.
---@field strain_factor number? Stable strain relative to that of its asset; nil unless soft.
---@field coating number? Static friction of its coating, which is that of every pair with it; nil without one.
---@field yaw number Rotation of its bounding box about the vertical, rad.
---@field hints table<string, number> Numbers of its asset for experts; those whose names end in _m are lengths and follow the scale.
---@field pose softvt.Pose Frame of its shape: the origin of an object is below its centre, at its lowest point.
---@field joint number? Joint value of a part, m or rad; nil for a whole object, as are the next three.
---@field joint_range number[]? Lowest and highest value of its joint, m or rad.
---@field joint_axis number[]? Direction in which the value of a slider grows, or the axis about which that of a hinge does; world frame.
---@field joint_origin number[]? A point of the axis of a hinge, world frame, m.
---@field joints table<string, number> Joint values of an articulated object by part, m or rad.
---@field parts table<string, softvt.ObjectState> Parts of an articulated object by name.
local ObjectState = {}

---The instances that a suite can draw, for a controller that must not know which one it has.
---@class softvt.Instances
local Instances = {}

---Returns the names of the assets of the objects of all goals of the suite, each once.
---@return string[]
function Instances:kinds() end

---Returns instances of the asset of an object in the scene, or of a kind, drawn as the suite draws them, from a random stream that no episode uses: the same in every episode. Without a variation each is the asset itself.
---@param object string
---@param count integer
---@return softvt.InstanceState[]
function Instances:sample(object, count) end

---The robot arm as an expert controls it. Each motion takes as many control steps as it needs.
---@class softvt.Arm
---@field pose softvt.Pose Measured pose of the tool centre point.
---@field target softvt.Pose Pose of the last command.
---@field closure number Last commanded closure: 0 is open, 1 is closed.
---@field gripping boolean True from a call of grasp to the next call of release or open.
---@field feels boolean True under --policy tactile-servo, whose grasp closes by touch.
---@field width number Measured distance of the gels, m.
---@field stroke number Largest distance of the gels, m.
---@field finger_stiffness number Stiffness of the drive of a finger, N/m (robot.gripper.kp).
---@field finger_effort number Largest force of the drive of a finger, N (robot.gripper.effort).
---@field force number[] Sum of the normal forces at all contact points of the left and the right gel pad, N, whatever touches it; forces on the cases of the fingers do not count. On the edge of a pad the normals are oblique, and the sum is larger than the pressing force, which is -sim:tactile(side).force[3].
---@field grip_controller string? Name of the controller that takes the place of the expert's own grip, such as "size-seen" under --policy size-seen (experts.blind_grips). nil under policies that have none.
---@field instances softvt.Instances? With a grip_controller, which must not know the instance: the instances that the suite can draw. nil without.
---@field time number Time since the start, s.
---@field dt number Length of a control step, s.
local Arm = {}

---Sends one command and returns at the next control step.
---@param pose softvt.Pose
---@param closure number
function Arm:command(pose, closure) end

---Moves along a straight line with a smooth speed profile.
---@param pose softvt.Pose
---@param options? softvt.MotionOptions
function Arm:move_to(pose, options) end

---Moves by an offset in the world frame, m.
---@param offset number[]
---@param options? softvt.MotionOptions
function Arm:move_by(offset, options) end

---Closes or opens to a closure.
---@param closure number
---@param options? softvt.RateOptions
function Arm:close_to(closure, options) end

---Closes on an object, to a closure or until the width or the force of the options is reached. A binary gripper, which is either open or closed, closes here and not in close_to. A tactile servo lifts the hand by a few millimetres, finds the least grip that holds, goes back down and closes to that grip and a margin, whatever closure is given.
---@param closure number
---@param options? softvt.GraspOptions
function Arm:grasp(closure, options) end

---Releases an object by opening, by default wide.
---@param options? softvt.ReleaseOptions
function Arm:release(options) end

---Opens the gripper to its full stroke.
---@param options? softvt.RateOptions
function Arm:open(options) end

---Returns the present readings of the tactile sensors; the first call waits for a control step. Available in simulation:drive and under --policy tactile-servo.
---@return softvt.Fingers
function Arm:tactile() end

---Returns true if the arm gets to a pose from its present joint positions, to 1 mm and 0.01 rad, by the steps of inverse kinematics that a motion takes; else false and the distance at which it stops, m. It ignores obstacles. The distance may be 0 where only the angle is not reached.
---@param pose softvt.Pose
---@return boolean
---@return number
function Arm:reaches(pose) end

---Holds the last command for a time.
---@param seconds number
function Arm:wait(seconds) end

---Notes a number, such as the width of a grip, in the episode's record and in the manifest of a dataset. A further note of the same name replaces it.
---@param name string
---@param value number
function Arm:note(name, value) end

---Ends the expert. The last command stays, and the episode's record and the results contain the reason.
---@param reason string
function Arm:give_up(reason) end

---A list that belongs to an object: scene.base, material.albedo, scene.objects. #, [i], ipairs, pairs, table.unpack and table.concat work on it, and it is accepted wherever a list is expected. Numbers of a writable field can be written one by one: scene.base[1] = 0.1 has the effect of scene.base = { 0.1, 0, 0 }. Any other list is read-only.
---@class softvt.List
local List = {}

---The episode that begins.
---@class softvt.EpisodeBrief
---@field suite string? Name of the suite; nil in a judged run.
---@field task integer? Index of the task, from 0; nil in a judged run.
---@field prompt string Instruction of the task.
---@field episode integer? Index of the episode, from 0; nil in a judged run.
---@field id string? Name of the episode in a judged run (--seed-file), from which its draws cannot be computed.
local EpisodeBrief = {}

---The observation of a policy at a control step. Poses are of the tool centre point in the robot's base frame. The true state of the scene is not part of it. Its closure requires observes.drives.
---@class softvt.Observation
---@field time number Time since the policy took over, s.
---@field width number Measured distance of the gels, 0 to 0.08 m, with the steps and the offset of a real hand; exact with observes.drives.
---@field prompt string Instruction of the task.
---@field tactile softvt.Fingers Tactile sensors; requires observes.tactile.
---@field tactile_history softvt.Fingers[] Tactile sensors in the last 1 to 8 control steps, oldest first; requires observes.tactile.
---@field force softvt.Forces True forces on the gels; requires observes.force.
---@field position number[] Tool position, m.
---@field axis_angle number[] Tool orientation as axis-angle, rad, continuous along the episode: its length may exceed π.
---@field quaternion number[] Tool orientation as quaternion w, x, y, z with w ≥ 0.
---@field joints number[] The seven joint angles of the arm, rad.
---@field joint_velocities number[] Velocities of the arm's joints, rad/s.
---@field joint_torques number[] Torques of the arm's drives in the physics step before, N m; gravity is compensated and not part of them.
---@field closure number Last commanded closure, 0 open to 1 closed.
local Observation = {}

---Returns the image of a camera in observes.cameras, 224 × 224 unless the scene defines another size.
---@param name string
---@return softvt.Image
function Observation:camera(name) end

---The tactile sensors of both fingers at one control step.
---@class softvt.Fingers
---@field left softvt.TactileFrame Frame of the left finger.
---@field right softvt.TactileFrame Frame of the right finger.
local Fingers = {}

---The tactile sensor of a finger at one control step; docs/tactile.md draws its frames.
---@class softvt.TactileFrame
---@field image softvt.Image Colour image, 320 × 240.
---@field difference softvt.Image Absolute difference of every channel from the image of the untouched gel.
---@field markers softvt.Markers The 11 × 9 markers.
local TactileFrame = {}

---The 99 markers of a finger, row by row, in px of its image: x to the right (towards the hand), y down. 1 px is 0.063 mm.
---@class softvt.Markers
---@field initial number[][] Positions on the untouched gel.
---@field present number[][] Present positions of the markers.
---@field motion number[][] Displacements of the markers from rest.
local Markers = {}

---Returns the mean displacement along x and y, which grows with shear along the gel's surface.
---@return number[]
function Markers:mean() end

---Returns the length of the longest displacement.
---@return number
function Markers:max_displacement() end

---Returns the root mean square of the displacements without their mean and twist. It grows with the normal force: about 0.3 px per newton on round dough and rigid objects, less on flat and soft ones.
---@return number
function Markers:rms_residual() end

---Returns the mean displacement towards the fingertip or across, as of an object that slips out of the grasp; 0 if it is pushed in.
---@return number
function Markers:outward_shear() end

---Returns the trace of the displacement gradient; positive where an indentation pushes the markers outwards, negative where a soft flat body draws them together.
---@return number
function Markers:divergence() end

---Returns the rotation of the markers, rad; positive is clockwise in the image.
---@return number
function Markers:twist() end

---Returns the pure shear of the markers: stretch along x against y, and along the diagonal x = y.
---@return number[]
function Markers:shear() end

---Returns the contact mask: true for markers displaced by more than px.
---@param px number
---@return boolean[]
function Markers:contact_mask(px) end

---Returns the share of markers displaced by more than px; the whole image is 20.3 × 15.2 mm.
---@param px number
---@return number
function Markers:contact_share(px) end

---True forces on the gels, N, pad frame: a pressing body makes z negative.
---@class softvt.Forces
---@field left number[] Force on the left gel.
---@field right number[] Force on the right gel.
local Forces = {}

---The softvt library.
softvt = {}

---Version of softvt.
---@type string
softvt.version = ""

---A set of tasks that are reported together.
---@param spec softvt.Suite
---@return softvt.Suite
function softvt.suite(spec) end

---A task of a suite.
---@param spec softvt.Task
---@return softvt.Task
function softvt.task(spec) end

---A change of the scene that a run can request with --shift name=value. Limits of D stay those of the assets.
---@param spec softvt.Shift
---@return softvt.Shift
function softvt.shift(spec) end

---A number of each episode in addition to its verdict, from the true state, which policies do not see.
---@param spec softvt.Metric
---@return softvt.Metric
function softvt.metric(spec) end

---Ranges from which every episode of a suite draws: factors on size, stiffness, density and friction of each soft object, its colour, the light and the poses of the cameras. The policy sees none of the drawn numbers; records do.
---@param spec softvt.Variation
---@return softvt.Variation
function softvt.variation(spec) end

---Runs suites as they are, then under each condition, and compares them episode by episode.
---@param spec softvt.Conditions
---@return softvt.Conditions
function softvt.conditions(spec) end

---A function that is evaluated at points and returns rows of results. Give either grid or points.
---@param spec softvt.Experiment
---@return softvt.Experiment
function softvt.experiment(spec) end

---The object rests on the target, released, for a time.
---@param spec softvt.On
---@return softvt.On
function softvt.on(spec) end

---The object rests in the target's cavity, carried by it or by objects in it, released, for a time. The cavity is the space in which its shape holds water.
---@param spec softvt.Inside
---@return softvt.Inside
function softvt.inside(spec) end

---Each object rests on the one before it in the list, released, for a time.
---@param spec softvt.Stacked
---@return softvt.Stacked
function softvt.stacked(spec) end

---A joint is open.
---@param spec softvt.Opened
---@return softvt.Opened
function softvt.opened(spec) end

---A joint is closed.
---@param spec softvt.Closed
---@return softvt.Closed
function softvt.closed(spec) end

---The value of a joint is within a range.
---@param spec softvt.Turned
---@return softvt.Turned
function softvt.turned(spec) end

---The centres of two objects are near each other in the horizontal plane, and the robot does not touch the object, for a time.
---@param spec softvt.Near
---@return softvt.Near
function softvt.near(spec) end

---The object is beside the target, within 45° of a direction of the robot's base, and the robot does not touch it, for a time.
---@param spec softvt.Beside
---@return softvt.Beside
function softvt.beside(spec) end

---The z axis of the object is upright, and the robot does not touch the object, for a time.
---@param spec softvt.Upright
---@return softvt.Upright
function softvt.upright(spec) end

---A function of the true scene returns true at the end of a control step. It must depend on its argument alone: variables that it changes are not part of the state of an episode.
---@param spec softvt.Predicate
---@return softvt.Predicate
function softvt.predicate(spec) end

---A kind of object. Its shape at rest has its lowest point at z = 0 and its centre on the z axis (see softvt.Shape:grounded).
---@param spec softvt.Asset
---@return softvt.Asset
function softvt.asset(spec) end

---A finite-element soft body of linear-elastic, isotropic material.
---@param spec softvt.Soft
---@return softvt.Soft
function softvt.soft(spec) end

---A free rigid body of uniform density.
---@param spec softvt.Rigid
---@return softvt.Rigid
function softvt.rigid(spec) end

---A fixed body, which never moves.
---@param spec softvt.Static
---@return softvt.Static
function softvt.static(spec) end

---Scenery: it is drawn and casts shadows, but has no contact.
---@param spec softvt.Scenery
---@return softvt.Scenery
function softvt.scenery(spec) end

---Parts on joints. The asset's own shape is their base, which never moves.
---@param spec softvt.Articulated
---@return softvt.Articulated
function softvt.articulated(spec) end

---A joint along which a part slides, such as that of a drawer. Values are in m.
---@param spec softvt.Slider
---@return softvt.Slider
function softvt.slider(spec) end

---A joint about which a part turns, such as that of a door or a knob. Values are in rad.
---@param spec softvt.Hinge
---@return softvt.Hinge
function softvt.hinge(spec) end

---A policy, as the file given to --policy returns it. Every episode has a virtual machine of its own, in which the file runs again; math.random is seeded by the episode.
---@param spec softvt.Policy
---@return softvt.Policy
function softvt.policy(spec) end

---The messages of a policy server: the observations it gets and the meaning of its actions. The file given to --profile returns one.
---@param spec softvt.Profile
---@return softvt.Profile
function softvt.profile(spec) end

---Checks a table that a function of a script takes, and returns it: `softvt.check_fields("pick_place", spec, { object = "string", speed = "number?" })`. Each key has the name of a Lua type, with ? if it may be absent. The error is at the line of the file that called the function.
---@param label string
---@param value table
---@param fields table<string, string>
---@return table
function softvt.check_fields(label, value, fields) end

---Returns a goal that holds while all of these do: `softvt.all { softvt.opened {…}, softvt.on {…} }`.
---@param goals softvt.Goal[]
---@return softvt.All
function softvt.all(goals) end

---Returns a goal that holds while at least one of these does.
---@param goals softvt.Goal[]
---@return softvt.Any
function softvt.any(goals) end

---Returns a goal that holds while none of these does.
---@param goals softvt.Goal[]
---@return softvt.None
function softvt.none(goals) end

---Returns a goal that holds while the last of these does, once each of the others has held, in this order.
---@param goals softvt.Goal[]
---@return softvt.Sequence
function softvt.sequence(goals) end

---softvt.beside with side = "left_of".
---@param of { object: string, target: string, distance: number?, hold_s: number? }
---@return softvt.Beside
function softvt.left_of(of) end

---softvt.beside with side = "right_of".
---@param of { object: string, target: string, distance: number?, hold_s: number? }
---@return softvt.Beside
function softvt.right_of(of) end

---softvt.beside with side = "in_front_of".
---@param of { object: string, target: string, distance: number?, hold_s: number? }
---@return softvt.Beside
function softvt.in_front_of(of) end

---softvt.beside with side = "behind".
---@param of { object: string, target: string, distance: number?, hold_s: number? }
---@return softvt.Beside
function softvt.behind(of) end

---Returns a layout, given by name and function or by a table of name and build: `softvt.layout("table", function(scene, rng) … end)`.
---@param name string|softvt.Layout
---@param build fun(scene: softvt.Scene, rng: softvt.Rng)
---@return softvt.Layout
function softvt.layout(name, build) end

---Returns an empty world: soft bodies among fixed or prescribed solids, without a robot. Settings of the command line, --set physics.…, take precedence in experiments.
---@param spec? softvt.WorldSpec
---@return softvt.World
function softvt.world(spec) end

---Returns the fingerprint of an asset: a hash of its shape, material and friction. Calibrations refer to it.
---@param asset softvt.Asset
---@return string
function softvt.fingerprint(asset) end

---Returns what is most likely a mistake in an asset, as softvt check tells it.
---@param asset softvt.Asset
---@return string[]
function softvt.asset_warnings(asset) end

---Builds a scene with the robot and lets it settle. Deformation refers to the settled shapes.
---@param spec softvt.SimulateSpec
---@return softvt.Simulation
function softvt.simulate(spec) end

---Returns the results of a calibration: the safe window, the deformation limit τ, and the files to write.
---@param spec softvt.EnvelopeSpec
---@return softvt.Envelope
function softvt.envelope(spec) end

---Returns the content of assets/calibration/<asset>.json as softvt.envelope does; nil if there is no such file.
---@param asset string
---@return softvt.Envelope?
function softvt.calibration(asset) end

---Returns the content of assets/draws/<asset>.json, the draw reference of an asset, from the JSON text of a calibration. Nil if the asset has such a file, which no calibration replaces, and without a window.
---@param asset softvt.Asset
---@param calibration string
---@return string?
function softvt.draw_reference(asset, calibration) end

---Returns the safe window of an instance of a calibrated asset; nil without a window. Experts see the factors as fields of their objects.
---@param spec softvt.Instance
---@return softvt.InstanceWindow?
function softvt.grip_window(spec) end

---Returns instances of an asset as the episodes of a suite draw them, from a random stream that no episode uses. Without a variation each is the asset itself.
---@param spec softvt.Sample
---@return softvt.InstanceState[]
function softvt.sample_instances(spec) end

---Returns true if a row of a compression sweep is a stable squeeze.
---@param row table
---@return boolean
function softvt.stable(row) end

---Returns the force per pad (N) at a width (mm), linear between the rows of a compression sweep by decreasing width; nil outside of the sweep.
---@param sweep table<string, any>[]
---@param width_mm number
---@return number?
function softvt.force_at(sweep, width_mm) end

---Returns measures of the standard hand: stroke is the largest distance of the gels, m; case_across is half of the thickness of a finger's sensor case across the finger, m; case_below is its extent below the tool centre point, m; finger_stiffness is that of the drive of a finger, N/m, which for the robot of a run is arm.finger_stiffness.
---@return table<string, number>
function softvt.hand() end

---Returns the instances that a suite can draw, by its own variation.
---@param suite softvt.Suite
---@return softvt.Instances
function softvt.instances(suite) end

---Returns an image of one colour: `softvt.image { width = 640, height = 480, colour = { 255, 255, 255 } }`.
---@param spec softvt.NewImage
---@return softvt.Image
function softvt.image(spec) end

---Returns a plot as SVG, for the files of an experiment: `softvt.plot { title = "…", x = { label = "gap" }, y = { label = "D, %" }, series = { { label = "bun", points = { { 40, 0.1 }, { 38, 0.4 } } } } }`.
---@param spec softvt.Plot
---@return string
function softvt.plot(spec) end

---Returns a pose in the world frame: `softvt.pose { position = { 0.4, 0, 0.2 }, yaw = math.pi / 2 }`. Without a quaternion the hand points straight down.
---@param spec softvt.PoseSpec
---@return softvt.Pose
function softvt.pose(spec) end

---Has the objects that an expert names checked in every scene in which its task runs, and returns the expert: `return softvt.check_names("nudge", run, spec, { object = "object" })`. The kinds of the fields of `spec` are "object" (one that moves), "place" (an object or a part), "joint" (a part, cabinet.top_drawer) and "value of joint" (a number in the range of the joint that the field `joint` names). Experts in `spec` are checked as well. softvt check reports a wrong name at the line of the file that called the function which makes the expert.
---@param label string
---@param expert fun(arm: softvt.Arm, scene: softvt.SceneState)
---@param spec table
---@param kinds table<string, "object"|"place"|"joint"|"value of joint">
---@return fun(arm: softvt.Arm, scene: softvt.SceneState)
function softvt.check_names(label, expert, spec, kinds) end

---Reads a shape from an OBJ, STL or GLB file: `softvt.mesh { file = "mug.obj", scale = 0.001 }`. The surface must be closed. An asset without visuals has the colours and images of the materials in the file: Kd and map_Kd of the MTL files that an OBJ file names, or the base colours of a GLB file; images are PNG or JPEG. All objects of the file are one shape; of a GLB file those of its default scene. Vertices within 1e-6 of the diagonal are one where the surface is open without that.
---@param spec softvt.MeshSpec
---@return softvt.Shape
function softvt.mesh(spec) end

---Declares the script's options and returns their values, from the command line or by default: `local opt = softvt.options { gap_mm = { default = 40, unit = "mm", min = 1 } }`.
---@param options table<string, softvt.Option>
---@return table<string, any>
function softvt.options(options) end

---Iterates over keys and values in an order that does not depend on hashes: numbers, strings, booleans. In a script, pairs does the same.
---@param t table
---@return fun(): any, any
function softvt.sorted(t) end

---Shapes, in metres.
softvt.shape = {}

---@nodiscard
---A box centred on the origin.
---@param spec softvt.BoxSpec
---@return softvt.Shape
function softvt.shape.box(spec) end

---@nodiscard
---A sphere centred on the origin.
---@param spec softvt.SphereSpec
---@return softvt.Shape
function softvt.shape.sphere(spec) end

---@nodiscard
---An ellipsoid centred on the origin.
---@param spec softvt.EllipsoidSpec
---@return softvt.Shape
function softvt.shape.ellipsoid(spec) end

---@nodiscard
---A capsule along the z axis, centred on the origin.
---@param spec softvt.CapsuleSpec
---@return softvt.Shape
function softvt.shape.capsule(spec) end

---@nodiscard
---A cylinder along the z axis, centred on the origin.
---@param spec softvt.CylinderSpec
---@return softvt.Shape
function softvt.shape.cylinder(spec) end

---@nodiscard
---A torus about the z axis, centred on the origin.
---@param spec softvt.TorusSpec
---@return softvt.Shape
function softvt.shape.torus(spec) end

---@nodiscard
---A triangular prism along y in a box centred on the origin.
---@param spec softvt.WedgeSpec
---@return softvt.Shape
function softvt.shape.wedge(spec) end

---@nodiscard
---A polygon in (x, z), extruded along y and centred on y = 0.
---@param spec softvt.PrismSpec
---@return softvt.Shape
function softvt.shape.prism(spec) end

---@nodiscard
---A profile revolved about the z axis.
---@param spec softvt.LatheSpec
---@return softvt.Shape
function softvt.shape.lathe(spec) end

---Masks: weights of the layers of a visual.
softvt.mask = {}

---@nodiscard
---Cubes, every other one 1; one corner is at the origin.
---@param spec softvt.CheckerMask
---@return softvt.Mask
function softvt.mask.checker(spec) end

---@nodiscard
---Slabs across an axis.
---@param spec softvt.StripesMask
---@return softvt.Mask
function softvt.mask.stripes(spec) end

---@nodiscard
---Rises smoothly from 0 to 1 along an axis.
---@param spec softvt.GradientMask
---@return softvt.Mask
function softvt.mask.gradient(spec) end

---@nodiscard
---Cloudy noise with values around 0.5, few below 0.2 or above 0.8.
---@param spec softvt.NoiseMask
---@return softvt.Mask
function softvt.mask.noise(spec) end

---@nodiscard
---Annual rings of a trunk: cylinders about a line along z, distorted by noise.
---@param spec softvt.RingsMask
---@return softvt.Mask
function softvt.mask.rings(spec) end

---@nodiscard
---Boards along x, side by side in y, with one value per board.
---@param spec softvt.BoardsMask
---@return softvt.Mask
function softvt.mask.boards(spec) end

---@nodiscard
---The gaps between boards of these sizes.
---@param spec softvt.SeamsMask
---@return softvt.Mask
function softvt.mask.seams(spec) end

---@nodiscard
---Round specks, scattered in space.
---@param spec softvt.SpecksMask
---@return softvt.Mask
function softvt.mask.specks(spec) end

---@nodiscard
---A plain weave in x and y: high in the middle of a thread.
---@param spec softvt.WeaveMask
---@return softvt.Mask
function softvt.mask.weave(spec) end

---@nodiscard
---Surfaces that face a direction, by the cosine between their normal and that direction.
---@param spec? softvt.FacingMask
---@return softvt.Mask
function softvt.mask.facing(spec) end

---@nodiscard
---The inside of a shape: a painted rim, the grooves between ridges.
---@param spec softvt.InsideMask
---@return softvt.Mask
function softvt.mask.inside(spec) end

---@nodiscard
---The letters of a line of text, printed on surfaces that face the reader. Surfaces with text are drawn in finer detail.
---@param spec softvt.TextMask
---@return softvt.Mask
function softvt.mask.text(spec) end
