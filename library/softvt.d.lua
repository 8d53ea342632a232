---@meta softvt
-- Generated from the binding table; do not edit.

---A set of tasks that are reported together.
---@class softvt.Suite
---@field name string Name, as in results; part of the seed.
---@field object_type "deformable"|"rigid" What the objects are.
---@field variation "object"|"spatial" What varies between tasks.
---@field episodes? integer Episodes a task by default. Expects a whole number in 1..1000000. Default 5.
---@field tasks softvt.Task[] The tasks, in order.
---@field shifts? softvt.Shift[] Changes that a run may ask for.
---@field settings? table<string, table<string, any>> What it changes of the mechanics, the robot and the judge: { physics = {…}, robot = {…}, criteria = {…} }.

---One task of a suite.
---@class softvt.Task
---@field prompt string What the policy is told.
---@field layout softvt.Layout Where things stand at the start.
---@field goal softvt.On|softvt.Inside When it is done.
---@field expert? fun(arm: softvt.Arm, scene: softvt.View) A coroutine that does the task, with privileged state.
---@field budget_steps? integer Control steps (20 Hz) that the policy has; 500 where a suite varies layouts, 700 where it varies objects. Expects a whole number in 1..100000.

---The object rests on the target, released, for a time.
---@class softvt.On
---@field object string Scene name of the object.
---@field target string Scene name of what it must reach, or of a part of it (cabinet.top_drawer).
---@field hold_s? number How long it must stay. Expects seconds in 0..10. Default 0.4.

---The object rests inside the target's walls, released, for a time.
---@class softvt.Inside
---@field object string Scene name of the object.
---@field target string Scene name of what it must reach, or of a part of it (cabinet.top_drawer).
---@field hold_s? number How long it must stay. Expects seconds in 0..10. Default 0.4.

---A kind of object: its shape at rest with its lowest point at z = 0 and its centre on the z axis.
---@class softvt.Asset
---@field name string Name, as in results and calibration files.
---@field shape softvt.Shape Its shape, in metres.
---@field body softvt.Soft|softvt.Rigid|softvt.Articulated|softvt.Static|softvt.Scenery How it moves.
---@field friction? softvt.Friction Friction of its surface.
---@field visuals? softvt.Visual[] Appearances by material id of the shape; the first is id 0.
---@field hints? table<string, number> Numbers for experts (grasp height, closure …).

---A finite-element soft body of linear-elastic, isotropic material.
---@class softvt.Soft
---@field youngs_pa number Young's modulus. Expects pascals above 0.
---@field poisson number Poisson's ratio; 0.5 would be incompressible. Expects a number in 0..below 0.5.
---@field density number Density. Expects a number (kg/m³) above 0.
---@field resolution? integer Voxels along the longest edge of the bounding box. Expects a whole number in 1..64. Default 6.
---@field grasp_spacing? number Spacing of contact samples where a gripper can reach. Expects metres in 0.0001..0.02. Default 0.00075.

---A free rigid body of uniform density.
---@class softvt.Rigid
---@field density number Density. Expects a number (kg/m³) above 0.

---Parts on joints; the asset's own shape is their base, which never moves.
---@class softvt.Articulated
---@field parts softvt.Part[] The parts, in any order.

---A joint along which a part slides, as a drawer does.
---@class softvt.Slider
---@field axis number[] Direction in which its value grows. Expects a list of 3 numbers (object frame).
---@field lower number Lowest value. Expects metres.
---@field upper number Highest value, above the lowest. Expects metres.
---@field damping? number Viscous damping. Expects a number (N s/m) of 0 or more. Default 0.
---@field friction? number Dry friction. Expects a number (N) of 0 or more. Default 0.

---A joint about which a part turns, as a door or a knob does.
---@class softvt.Hinge
---@field axis number[] Axis about which its value grows, by the right hand. Expects a list of 3 numbers (object frame).
---@field origin number[] A point of the axis, with all joints at 0. Expects a list of 3 numbers (m, object frame).
---@field lower number Lowest value. Expects radians.
---@field upper number Highest value, above the lowest. Expects radians.
---@field damping? number Viscous damping. Expects a number (N m s/rad) of 0 or more. Default 0.
---@field friction? number Dry friction. Expects a number (N m) of 0 or more. Default 0.

---A part of the world that never moves.
---@class softvt.Static

---Part of the picture only: it is drawn, casts shadows, and nothing touches it.
---@class softvt.Scenery

---A change of the scene that a run may ask for with --shift name=value. Thresholds stay nominal.
---@class softvt.Shift
---@field name string Name on the command line.
---@field unit? string Unit of the value. Default "1".
---@field default number The value that changes nothing. Expects a number.
---@field min? number Lowest value. Expects a number.
---@field max? number Highest value. Expects a number.
---@field apply fun(scene: softvt.Scene, value: number): softvt.Scene? Changes the scene.

---Runs suites as they are, then under each condition, and compares episode by episode.
---@class softvt.Conditions
---@field name string Name, as in results.
---@field suites softvt.Suite[] The suites, in order.
---@field conditions softvt.Condition[] The conditions, in order.

---A function of a grid of parameters that yields rows. Give grid or points.
---@class softvt.Experiment
---@field name string Name, as in results.
---@field options? any What softvt.options gave; handed to the functions below as opt.
---@field grid? table<string, any[]> Values of each parameter; every combination is run, names in alphabetical order, the last one fastest.
---@field points? fun(opt: table): table[] Gives the points instead of a grid.
---@field run fun(point: table, opt: table): table|table[] Gives a row or a list of rows for one point; points run in any order and on several threads.
---@field finish? fun(rows: table[], opt: table): softvt.Finish? Sums up all rows.
---@field columns? string[] Columns of the table, in order; by default all, sorted.

---A policy, which the file behind --policy returns. Every episode has a machine of its own, in which the file is run anew; math.random is seeded by the episode.
---@class softvt.Policy
---@field name string Its name in results, unless --name says otherwise.
---@field looks? softvt.Looks What it looks at.
---@field reset? fun(task: softvt.Brief) Called when the episode begins.
---@field act fun(obs: softvt.Observation): softvt.Action|softvt.Action[] Gives the action of this control step, or a list of them for the next ones.
---@field replan? integer How many actions of a list are carried out, unless --replan says otherwise; all of them if left out. Expects a whole number in 1..10000.

---What a policy's server gets and what its numbers mean; the file behind --profile returns one.
---@class softvt.Profile
---@field name string Its name in results, unless --name says otherwise.
---@field inputs softvt.Input[] What is sent, in order.
---@field actions softvt.ActionEncoding How replies are read.

---How a scene is laid out. Tasks with the same layout name share their initial states.
---@class softvt.Layout
---@field name string Name; part of the seed.
---@field build fun(scene: softvt.Scene, rng: softvt.Rng) Puts the objects into the scene.

---Coulomb friction of a surface; a pair of surfaces takes the larger of each coefficient.
---@class softvt.Friction
---@field static_mu? number Static coefficient. Expects a number in 0..10. Default 0.6.
---@field dynamic_mu? number Dynamic coefficient, not above the static one. Expects a number in 0..10. Default 0.5.

---A part of an articulated object. Parts of one object never touch each other or its base.
---@class softvt.Part
---@field name string Name, unique in the object: cabinet.top_drawer in a scene.
---@field shape softvt.Shape Its shape where it is with all joints at 0, in the frame of the whole object; walls of 4 mm or more.
---@field density number Density. Expects a number (kg/m³) above 0.
---@field joint softvt.Slider|softvt.Hinge What carries it; axes and origins are in the frame of the whole object.
---@field parent? string The part that carries it; the fixed base by default.
---@field visuals? softvt.Visual[] Appearances by material id of its shape; the first is id 0. Those of the asset by default.
---@field hints? table<string, number> Numbers for experts (handle height …).

---What a surface looks like: a base, and layers painted over it one after the other.
---@class softvt.Visual
---@field albedo number[] Base colour. Expects a list of 3 numbers in 0..1 (linear RGB).
---@field roughness? number Roughness: 0 is a mirror, 1 is chalk. Expects a number in 0..1. Default 0.6.
---@field metalness? number Metalness: 1 is bare metal. Expects a number in 0..1. Default 0.
---@field layers? softvt.Layer[] Painted over the base, in this order.

---A colour laid over what is below where a mask says so.
---@class softvt.Layer
---@field mask? softvt.Mask Where; everywhere if left out.
---@field albedo number[] Colour. Expects a list of 3 numbers in 0..1 (linear RGB).
---@field roughness? number Roughness. Expects a number in 0..1. Default 0.6.
---@field opacity? number Share of this layer where the mask is 1; 0 leaves the relief alone. Expects a number in 0..1. Default 1.
---@field relief_m? number Height of the drawn surface where the mask is 1; it is drawn only, nothing touches it. Expects metres in -0.005..0.005. Default 0.

---One way in which a run differs from its reference: same tasks, initial states and seeds, other shifts or settings.
---@class softvt.Condition
---@field name string Name, as in the table; its run is in a folder of that name.
---@field shift? table<string, number> Shifts by name, as --shift takes them: { mass = 1.25 }.
---@field set? table<string, number|boolean|string> Settings by path, as --set takes them: { ["robot.gripper.effort"] = 20 }.
---@field only? "deformable"|"rigid" The object_type of the suites of which it can change anything; in others it is not run, and its row says N/A.

---What an experiment leaves behind besides its rows.
---@class softvt.Finish
---@field text? string Printed after the rows.
---@field files? table<string, string|softvt.Image|table<string, any>|any[]> Files to write, by relative path: text as it is, pictures as PNG, tables as JSON with sorted keys.

---An option of the script: key gap_mm is --gap-mm on the command line. The default gives the type.
---@class softvt.Option
---@field default any A number, string, boolean, or list of numbers or strings.
---@field integer? boolean Whether only whole numbers are taken. Default false.
---@field unit? string Unit of a number. Default "".
---@field min? number Lowest number. Expects a number.
---@field max? number Highest number. Expects a number.
---@field choices? string[] The only strings allowed.
---@field help? string What it does, for --help. Default "".

---An asset put somewhere. Give at or xyz.
---@class softvt.Place
---@field name string Name in the scene, unique.
---@field asset softvt.Asset What it is.
---@field at? number[] x, y; it stands on the table, or on what `on` names. Expects a list of 2 numbers (m, world).
---@field xyz? number[] Its origin: lowest point, on the centre line. Expects a list of 3 numbers (m, world).
---@field yaw? number Turn about the vertical. Expects radians. Default 0.
---@field on? string Scene name of an object or part (cabinet.top_drawer) that it stands on (with at).
---@field joints? table<string, number> Start values of an articulated object's joints by part; 0, or the nearest limit, by default.

---A pose in the world frame. Without a quaternion the hand points straight down.
---@class softvt.PoseSpec
---@field xyz number[] Position. Expects a list of 3 numbers (m, world).
---@field yaw? number Turn of the downward hand about the vertical. Expects radians. Default 0.
---@field quat? number[] Orientation instead of yaw. Expects a list of 4 numbers (w, x, y, z).

---How a hand would be held, and what it may touch.
---@class softvt.Clearance
---@field width? number Distance of the pads. Expects metres in 0..0.08. Default 0.08.
---@field ignore? string[] Scene names of what it may touch.

---A camera. Give look_at or quat.
---@class softvt.NewCamera
---@field name string Its name, unique; the stream's.
---@field mount? "world"|"hand" What it is fixed to; hand is panda_hand. Default "world".
---@field position number[] Where it is. Expects a list of 3 numbers (m, frame of the mount).
---@field look_at? number[] A point in the middle of the picture. Expects a list of 3 numbers (m, frame of the mount).
---@field up? number[] Upwards in the picture (with look_at); z if left out. Expects a list of 3 numbers (frame of the mount).
---@field quat? number[] How it is turned: it looks along its −z, +y is up. Expects a list of 4 numbers (w, x, y, z, frame of the mount).
---@field fovy? number Vertical field of view. Expects radians in 0.01..2.8. Default 0.8.
---@field near? number Nothing nearer is seen. Expects metres in 0.0001..100. Default 0.01.
---@field far? number Nothing farther is seen. Expects metres in 0.001..10000. Default 20.
---@field width? integer Width of the picture, pixels. Expects a whole number in 1..4096. Default 224.
---@field height? integer Height of the picture, pixels. Expects a whole number in 1..4096. Default 224.

---An empty picture.
---@class softvt.NewImage
---@field width integer Width, pixels. Expects a whole number in 1..8192.
---@field height integer Height, pixels. Expects a whole number in 1..8192.
---@field colour number[] Colour all over. Expects a list of 3 numbers (sRGB of 0 to 255).

---Where and how a line of text is written.
---@class softvt.Text
---@field at number[] Left end of its baseline, from the top left. Expects a list of 2 numbers (pixels).
---@field size? number Height. Expects a number (pixels) in 4..200. Default 18.
---@field colour number[] Colour. Expects a list of 3 numbers (sRGB of 0 to 255).

---What is drawn.
---@class softvt.See
---@field camera? string A camera of the scene. Default "third_person".
---@field width? integer Width, pixels; the camera's own. Expects a whole number in 1..4096.
---@field height? integer Height, pixels; the camera's own. Expects a whole number in 1..4096.

---A world of soft bodies and prescribed or fixed solids, without a robot.
---@class softvt.WorldSpec
---@field dt? number Time step. Expects seconds in 0.00001..0.05. Default 0.016666666666666666.
---@field alpha? number Mass-proportional damping. Expects a number (1/s) in 0..1000. Default 0.
---@field beta_s? number Stiffness-proportional damping. Expects seconds in 0..1. Default 0.005.
---@field gravity? number[] Gravity; {0, 0, -9.81} by default. Expects a list of 3 numbers (m/s²).
---@field sleeping? boolean Whether bodies at rest fall asleep. Default true.

---A finite-element soft body in a world.
---@class softvt.WorldSoft
---@field name? string Name, for messages. Default "body".
---@field shape softvt.Shape Its shape.
---@field youngs_pa number Young's modulus. Expects pascals above 0.
---@field poisson number Poisson's ratio. Expects a number in 0..below 0.5.
---@field density number Density. Expects a number (kg/m³) above 0.
---@field resolution? integer Voxels along the longest edge. Expects a whole number in 1..64. Default 6.
---@field grasp_spacing? number Spacing of contact samples on steep surfaces. Expects metres in 0.0001..0.02. Default 0.00075.
---@field friction? softvt.Friction Friction of its surface.
---@field xyz number[] Where its frame is. Expects a list of 3 numbers (m).
---@field turn? number[] Its orientation as axis-angle. Expects a list of 3 numbers (rad).

---A solid whose motion is prescribed (kinematic) or that never moves (static).
---@class softvt.WorldSolid
---@field name? string Name, for messages. Default "solid".
---@field shape softvt.Shape Its shape.
---@field friction? softvt.Friction Friction of its surface.
---@field xyz number[] Where its frame is. Expects a list of 3 numbers (m).
---@field turn? number[] Its orientation as axis-angle. Expects a list of 3 numbers (rad).

---A scene with the robot, built and settled. The settled shapes are the reference of deformation.
---@class softvt.SimulateSpec
---@field layout softvt.Layout Where things stand.
---@field suite? string Part of the seed. Default "experiment".
---@field episode? integer Part of the seed. Expects a whole number in 0..1000000000. Default 0.
---@field seed? integer Part of the seed. Expects a whole number in 0..1000000000. Default 0.
---@field settings? table<string, table<string, any>> Changes of the mechanics, the robot and the judge: { physics = {…}, robot = {…}, criteria = {…} }.

---The rows of a calibration.
---@class softvt.EnvelopeSpec
---@field asset string Asset name.
---@field kappa? number τ = κ D_ref. Expects a number in 0..1. Default 0.5.
---@field fingerprint? string What was calibrated, as simulation:watch tells it; another object of that name is then not taken for it.
---@field holds table<string, any>[] Rows closure, trials, held, slip_mm, d_peak_pct of the lower-bound scan.
---@field sweep table<string, any>[] Rows closure, gripper_width_mm, d_peak_pct, force_n, min_det_f, node_speed_m_s, both_pads, slip_mm, stable of the compression sweep.

---What a policy looks at; nothing else is computed.
---@class softvt.Looks
---@field cameras? string[] Cameras of the scene, by name.
---@field touch? boolean Whether it feels what the fingers feel. Default false.
---@field force? boolean Whether it gets the true forces on the gels, which no real sensor gives: results say force_observed. Default false.

---A command for one control step (0.05 s): a pose of the tool centre point in the robot's base frame and a closure. Give axis_angle or rotation.
---@class softvt.Action
---@field position number[] Position. Expects a list of 3 numbers (m, base frame).
---@field axis_angle? number[] Orientation as axis-angle. Expects a list of 3 numbers (rad, base frame).
---@field rotation? number[] Orientation as quaternion. Expects a list of 4 numbers (w, x, y, z, base frame).
---@field closure number Gripper, 0 open to 1 shut. Expects a number in 0..1.

---One entry of the observations that a server gets.
---@class softvt.Input
---@field keys string[] Keys it is sent under.
---@field source "camera"|"state"|"prompt"|"tactile_image"|"tactile"|"marker_motion"|"force" What it is: a camera's picture; numbers of the robot; the instruction; the mosaic of 8 tactile pictures of both fingers; the last picture of one finger; the markers' first and last 8 places; the last 8 true forces on the gels.
---@field camera? string With camera: its name in the scene.
---@field half_turn? boolean With camera: whether the picture is turned by half a turn.
---@field parts? ("position"|"axis_angle"|"quaternion_wxyz"|"quaternion_xyzw"|"joints"|"gripper_width"|"finger_position"|"finger_pair"|"closure")[] With state: its parts in order, of 3, 3, 4, 4, 7, 1, 1, 2 and 1 numbers, in m and rad in the base frame.
---@field layout? "rows"|"columns" With tactile_image: the left finger above (rows, if left out) or at the left.
---@field finger? "left"|"right" With tactile: which.

---How the numbers of an action are read: three of position, three of orientation (axis-angle), one of the gripper; more are padding.
---@class softvt.ActionEncoding
---@field pose "absolute"|"delta"|"delta_osc" absolute: a pose in the base frame. delta: shares -1 to 1 of a step away from where the tool is. delta_osc: the same, as far as robosuite's controller gets within a control step.
---@field translation_m? number With delta and delta_osc: the step that 1 means, m. Expects a number in above 0..10.
---@field rotation_rad? number With delta and delta_osc: the turn that 1 means, rad. Expects a number in above 0..10.
---@field scale? number[] The first six numbers are multiplied by these first. Expects a list of 6 numbers.
---@field offset? number[] Then these are added. Expects a list of 6 numbers.
---@field length? integer How many numbers an action must have, padding included; any from 7 on if left out. Expects a whole number in 7..4096.
---@field gripper softvt.GripperValues The seventh number.

---The seventh number of an action: one value opens, one shuts, those between in proportion.
---@class softvt.GripperValues
---@field open number The value that opens. Expects a number.
---@field shut number The value that shuts. Expects a number.
---@field binary? boolean Whether all beyond the middle shuts and all else opens. Default false.

---A box centred on the origin.
---@class softvt.BoxSpec
---@field size number[] Edge lengths. Expects a list of 3 numbers (m).

---A sphere centred on the origin.
---@class softvt.SphereSpec
---@field radius number Radius. Expects metres above 0.

---An ellipsoid centred on the origin.
---@class softvt.EllipsoidSpec
---@field size number[] Lengths of the axes (diameters). Expects a list of 3 numbers (m).

---A capsule about the z axis, centred on the origin.
---@class softvt.CapsuleSpec
---@field radius number Radius. Expects metres above 0.
---@field length number Total length, caps included; at least twice the radius. Expects metres above 0.

---A cylinder about the z axis, centred on the origin.
---@class softvt.CylinderSpec
---@field radius number Radius. Expects metres above 0.
---@field height number Height. Expects metres above 0.

---A torus about the z axis, centred on the origin.
---@class softvt.TorusSpec
---@field major number Radius of the middle of the tube. Expects metres above 0.
---@field minor number Radius of the tube, less than major. Expects metres above 0.

---A triangular prism along y in a box centred on the origin.
---@class softvt.WedgeSpec
---@field size number[] Edge lengths of the box. Expects a list of 3 numbers (m).
---@field apex? number Where the top edge lies across the width: -1 and 1 are the sides, 0 the middle. Expects a number in -1..1. Default 0.

---A polygon in (x, z), drawn out along y, centred on y = 0.
---@class softvt.PrismSpec
---@field corners number[][] Corners (x, z) in order.
---@field length number Length along y. Expects metres above 0.

---A profile revolved about the z axis.
---@class softvt.LatheSpec
---@field corners number[][] Corners (r, z) in order, r of 0 or more.

---A turn about an axis through the origin.
---@class softvt.RotateSpec
---@field axis "x"|"y"|"z" The axis.
---@field angle number Angle, right-handed. Expects radians.

---A twist about an axis through the origin.
---@class softvt.TwistSpec
---@field axis "x"|"y"|"z" The axis.
---@field rate number Turn along the axis. Expects a number (rad/m).

---A bend into an arc; the origin stays.
---@class softvt.BendSpec
---@field along "x"|"y"|"z" The axis that becomes an arc.
---@field towards "x"|"y"|"z" The axis on which the centre of the arc lies.
---@field curvature number Curvature of the arc. Expects a number (1/m).

---Regular ridges: rings, flutes, screws or spirals.
---@class softvt.RidgesSpec
---@field axis? "x"|"y"|"z" The axis they go around or along. Default "z".
---@field height number From valley to crest; negative for grooves. Expects metres.
---@field count? integer Ridges around the axis. Expects a whole number in -1000..1000. Default 0.
---@field pitch? number Distance of ridges along the axis. Expects metres above 0.
---@field radial_pitch? number Distance of ridges away from the axis. Expects metres above 0.
---@field phase? number Phase. Expects radians. Default 0.
---@field sharpness? number 1 is a sine; larger is narrower. Expects a number in 1..8. Default 1.
---@field mask? softvt.MaskSpec Where they are.

---Scattered bumps (seeds, raisins).
---@class softvt.BumpsSpec
---@field height number Height; negative for pits. Expects metres.
---@field radius number Radius of a bump, at most half the spacing. Expects metres above 0.
---@field spacing number Mean distance of bumps. Expects metres above 0.
---@field seed? integer Selects where they are. Expects a whole number of 0 or more. Default 0.
---@field mask? softvt.MaskSpec Where they are.

---Another material on all or part of the surface.
---@class softvt.PaintSpec
---@field material integer Material id: index into visuals, from 0. Expects a whole number in 0..65535.
---@field region? softvt.Shape Where; everywhere if left out.

---A weight that rises smoothly from 0 to 1 along an axis.
---@class softvt.MaskSpec
---@field axis "x"|"y"|"z" The axis.
---@field from number Where it is 0. Expects metres.
---@field to number Where it is 1. Expects metres.

---A closed surface from an OBJ, STL or GLB file.
---@class softvt.MeshSpec
---@field file string Path inside of the project.
---@field scale? number Metres in a unit of the file: 0.001 for millimetres. Expects metres above 0. Default 1.
---@field z_up? boolean Whether z is up in the file; otherwise y is. Default true.

---Cubes, every other one 1; a corner lies at the origin.
---@class softvt.CheckerMask
---@field size_m number Edge of a cube. Expects metres above 0.

---Slabs across an axis.
---@class softvt.StripesMask
---@field axis "x"|"y"|"z"|number[] Direction in which they follow each other.
---@field pitch_m number Distance from one to the next. Expects metres above 0.
---@field share? number Share of it that is 1. Expects a number in 0..1. Default 0.5.

---Rises smoothly from 0 to 1 along an axis.
---@class softvt.GradientMask
---@field axis? "x"|"y"|"z"|number[] Direction. Default "z".
---@field from_m number Where it is 0. Expects metres.
---@field to_m number Where it is 1; may lie below from_m. Expects metres.

---Cloudy noise; its values lie about 0.5, few below 0.2 or above 0.8.
---@class softvt.NoiseMask
---@field size_m number|number[] Size of the coarsest features, one for all or one for each of x, y and z.
---@field octaves? integer Octaves, each half the size and half the weight of the one before. Expects a whole number in 1..8. Default 3.
---@field from? number Value of the noise that becomes 0. Expects a number in -1..2. Default 0.35.
---@field to? number Value that becomes 1; may lie below from. Expects a number in -1..2. Default 0.65.
---@field seed? integer Selects the pattern. Expects a whole number in 0..4294967295. Default 0.

---Year rings of a trunk: cylinders about a line along z, bent by noise.
---@class softvt.RingsMask
---@field centre_m number[] A point of the line. Expects a list of 3 numbers (m).
---@field pitch_m number Distance from one ring to the next. Expects metres above 0.
---@field wobble_m? number How far noise bends them. Expects metres above 0. Default 0.01.
---@field seed? integer Selects the pattern. Expects a whole number in 0..4294967295. Default 0.

---Boards that lie along x, side by side in y: one value a board.
---@class softvt.BoardsMask
---@field length_m number Length of a board. Expects metres above 0.
---@field width_m number Width of a board. Expects metres above 0.
---@field seed? integer Selects the pattern. Expects a whole number in 0..4294967295. Default 0.

---The gaps between boards of these sizes.
---@class softvt.SeamsMask
---@field length_m number Length of a board. Expects metres above 0.
---@field width_m number Width of a board. Expects metres above 0.
---@field gap_m number Width of a gap. Expects metres above 0.

---Round specks, strewn about.
---@class softvt.SpecksMask
---@field spacing_m number Mean distance. Expects metres above 0.
---@field radius_m number Radius, at most half the spacing. Expects metres above 0.
---@field seed? integer Selects the pattern. Expects a whole number in 0..4294967295. Default 0.

---A plain weave in x and y: high in the middle of a thread.
---@class softvt.WeaveMask
---@field pitch_m number Width of a thread. Expects metres above 0.

---Where the surface faces a direction, by the cosine between its normal and that.
---@class softvt.FacingMask
---@field axis? "x"|"y"|"z"|number[] Direction. Default "z".
---@field from? number Cosine at which it is 0. Expects a number in -1..1. Default 0.
---@field to? number Cosine at which it is 1; may lie below from. Expects a number in -1..1. Default 1.

---Where a shape is: a painted rim, the grooves between ridges.
---@class softvt.InsideMask
---@field shape softvt.Shape The shape.
---@field soft_m? number Width of the border, half of it on either side of the shape's surface. Expects metres of 0 or more. Default 0.

---The letters of a line of text, printed on what faces who reads it. Surfaces with text are drawn with finer detail than others.
---@class softvt.TextMask
---@field text string What it says: at most 64 letters.
---@field height_m number Height of a capital letter. Expects metres in 0.0005..1.
---@field at number[] Where the middle of the line is; of a line that is wrapped, only its height counts. Expects a list of 3 numbers (m).
---@field facing "+x"|"-x"|"+y"|"-y"|"+z"|"-z"|number[] Where the printed surface looks. Lines on top have their head towards +y, others towards +z.
---@field turn? number Turn of the line on its surface, counter-clockwise to who reads it. Expects radians. Default 0.
---@field wrap_m? number Radius of the upright cylinder about the z axis that the line is laid round; flat if left out. Expects metres above 0.
---@field weight? number How much strokes are thickened, in heights of a capital letter. Expects a number in 0..0.25. Default 0.08.
---@field font? "sans"|"mono" Typeface. Default "sans".

---A solid. Methods give a new shape and leave this one as it is.
---@class softvt.Shape
local Shape = {}

---Moved by an offset, m.
---@param x number
---@param y number
---@param z number
---@return softvt.Shape
function Shape:translate(x, y, z) end

---Stretched by factors; one factor counts for all axes.
---@param x number
---@param y? number
---@param z? number
---@return softvt.Shape
function Shape:scale(x, y, z) end

---Grown by a radius (m), which rounds convex edges.
---@param radius number
---@return softvt.Shape
function Shape:round(radius) end

---The wall of this thickness (m) under the surface.
---@param wall number
---@return softvt.Shape
function Shape:shell(wall) end

---This or the other.
---@param other softvt.Shape
---@return softvt.Shape
function Shape:union(other) end

---This and the other.
---@param other softvt.Shape
---@return softvt.Shape
function Shape:intersect(other) end

---This without the other; blend (m) rounds the edge.
---@param cut softvt.Shape
---@param blend? number
---@return softvt.Shape
function Shape:subtract(cut, blend) end

---This or the other, with a fillet of width blend (m).
---@param other softvt.Shape
---@param blend number
---@return softvt.Shape
function Shape:smooth_union(other, blend) end

---Lowest and highest corner of the bounding box, m.
---@return number[]
---@return number[]
function Shape:bounds() end

---Its volume, m³.
---@return number
function Shape:volume() end

---Moved so that its lowest point is at z = 0 and its centre on the z axis.
---@return softvt.Shape
function Shape:grounded() end

---A turn about an axis through the origin.
---@param spec softvt.RotateSpec
---@return softvt.Shape
function Shape:rotate(spec) end

---A twist about an axis through the origin.
---@param spec softvt.TwistSpec
---@return softvt.Shape
function Shape:twist(spec) end

---A bend into an arc; the origin stays.
---@param spec softvt.BendSpec
---@return softvt.Shape
function Shape:bend(spec) end

---Regular ridges: rings, flutes, screws or spirals.
---@param spec softvt.RidgesSpec
---@return softvt.Shape
function Shape:ridges(spec) end

---Scattered bumps (seeds, raisins).
---@param spec softvt.BumpsSpec
---@return softvt.Shape
function Shape:bumps(spec) end

---Another material on all or part of the surface.
---@param spec softvt.PaintSpec
---@return softvt.Shape
function Shape:paint(spec) end

---A number between 0 and 1 at every point of a surface: where a layer is. It never changes; methods give new masks.
---@class softvt.Mask
local Mask = {}

---Where this and the other are: their product.
---@param other softvt.Mask
---@return softvt.Mask
function Mask:both(other) end

---Where this is not.
---@return softvt.Mask
function Mask:inverted() end

---The mechanics alone: soft bodies among solids that stand still or move as prescribed.
---@class softvt.World
local World = {}

---Adds a soft body.
---@param spec softvt.WorldSoft
---@return softvt.Body
function World:soft(spec) end

---Adds a solid that move_to moves.
---@param spec softvt.WorldSolid
---@return softvt.Solid
function World:kinematic(spec) end

---Adds a solid that never moves.
---@param spec softvt.WorldSolid
---@return softvt.Solid
function World:static(spec) end

---One time step; false and why once the state is void.
---@return boolean
---@return string?
function World:step() end

---Time, s.
---@return number
function World:time() end

---Mean and largest number of Newton iterations a step.
---@return number
---@return integer
function World:newton() end

---Kinetic, elastic and potential energy, J.
---@return number
function World:energy() end

---From now on, CPU time goes to this phase.
---@param name string
function World:phase(name) end

---Prints CPU time per simulated time, by phase, to the standard error.
function World:report_timing() end

---A soft body of a world.
---@class softvt.Body
local Body = {}

---Centre of mass, m.
---@return number[]
function Body:centre() end

---Velocity of the centre of mass, m/s.
---@return number[]
function Body:velocity() end

---Speed of the fastest node, m/s.
---@return number
function Body:speed() end

---Mass, kg.
---@return number
function Body:mass() end

---Least det F of a filled element; 0 or less is inverted, nil where no element is filled.
---@return number?
function Body:min_det_f() end

---Whether it sleeps.
---@return boolean
function Body:asleep() end

---rms_pct, weighted_pct and max_pct against the reference shape.
---@return table
function Body:deformation() end

---Size of the bounding box of the nodes, m.
---@return number[]
function Body:extent() end

---Measures deformation from the rest shape (default) or from now.
---@param which "rest"|"now"
function Body:set_reference(which) end

---Normal force of a solid on the body, N.
---@param solid softvt.Solid
---@return number
function Body:force(solid) end

---Tangential force of a solid on the body, N.
---@param solid softvt.Solid
---@return number
function Body:shear(solid) end

---How far the patch has slid on the solid, mm.
---@param solid softvt.Solid
---@return number
function Body:travel(solid) end

---Share of the patch's samples that slip, 0..1.
---@param solid softvt.Solid
---@return number
function Body:slipping(solid) end

---A solid of a world.
---@class softvt.Solid
local Solid = {}

---Where it will be after the next step: position, m, and axis-angle, rad.
---@param xyz number[]
---@param turn? number[]
function Solid:move_to(xyz, turn) end

---A settled scene with the robot.
---@class softvt.Simulation
local Simulation = {}

---Runs an expert to its end; false and why once it has given up or the physics has failed.
---@param expert fun(arm: softvt.Arm, scene: softvt.View)
---@return boolean
---@return string?
function Simulation:drive(expert) end

---Holds the last command for a time.
---@param seconds number
---@return boolean
---@return string?
function Simulation:wait(seconds) end

---width_m, height_m (rise of the centre), speed, asset; of a part joint, of what has parts joints by name; of a movable object also pad_force (N) and slip_mm of the left and right pad, and of a soft one d_pct, d_peak_pct, min_det_f, asleep.
---@param object string
---@return table
function Simulation:watch(object) end

---What a camera sees now; third_person if nothing else is said.
---@param see? softvt.See
---@return softvt.Image
function Simulation:see(see) end

---What a finger's tactile sensor sees now, and the true force on its gel.
---@param side "left"|"right"
---@return softvt.Felt
function Simulation:feel(side) end

---Time since settling, s.
---@return number
function Simulation:time() end

---Tool position, m, and axis-angle, rad, world.
---@return number[]
---@return number[]
function Simulation:tool() end

---A finger's tactile sensor at one moment; docs/tactile.md draws its frames.
---@class softvt.Felt
---@field picture softvt.Image The colour picture, 320 × 240.
---@field dots softvt.Image The same with its markers as dots.
---@field arrows softvt.Image The same with the motion of its markers as arrows, lengthened.
---@field initial number[][] Places of the 99 markers without a touch, px, row by row.
---@field present number[][] Their places now, px.
---@field markers softvt.Markers The markers, with what their motion says.
---@field force number[] True force on the gel, N, pad frame; a pressing body makes z negative.
---@field depth_mm number Greatest depth of the dent, mm.
local Felt = {}

---A picture of 8-bit sRGB pixels. Regions are x, y, width, height in pixels from the top left.
---@class softvt.Image
---@field width integer Width, pixels.
---@field height integer Height, pixels.
local Image = {}

---Mean red, green and blue, 0..255.
---@param region? number[]
---@return number[]
function Image:mean(region) end

---Red, green and blue of a pixel, 0..255; the first is 0, 0.
---@param x integer
---@param y integer
---@return number[]
function Image:pixel(x, y) end

---A part as a picture of its own.
---@param region number[]
---@return softvt.Image
function Image:crop(region) end

---The same in another size.
---@param width integer
---@param height integer
---@return softvt.Image
function Image:resize(width, height) end

---Puts another picture on this one.
---@param other softvt.Image
---@param x number
---@param y number
function Image:paste(other, x, y) end

---Writes a line of text on it.
---@param text string
---@param how softvt.Text
function Image:text(text, how) end

---An immutable pose in the world frame.
---@class softvt.Pose
---@field x number Position, m.
---@field y number Position, m.
---@field z number Position, m.
---@field xyz number[] Position, m.
---@field quat number[] Orientation w, x, y, z with w of 0 or more.
local Pose = {}

---Moved by an offset in the world frame, m.
---@param by number[]
---@return softvt.Pose
function Pose:moved(by) end

---The same orientation at another place, m.
---@param xyz number[]
---@return softvt.Pose
function Pose:at(xyz) end

---Turned where it is about the world's vertical, rad.
---@param angle number
---@return softvt.Pose
function Pose:turned(angle) end

---Part of the way to another pose: 0 is here, 1 there.
---@param other softvt.Pose
---@param share number
---@return softvt.Pose
function Pose:towards(other, share) end

---Metres and radians to another pose.
---@param other softvt.Pose
---@return number
---@return number
function Pose:distance(other) end

---A named stream of random numbers, a function of suite, layout, episode, seed and split alone.
---@class softvt.Rng
local Rng = {}

---Another stream, from its start.
---@param name "layout"|"arm"|"material"|"light"|"camera"|"sensor"|"expert"|"script"|"policy"
---@return softvt.Rng
function Rng:stream(name) end

---Uniform from a to below b.
---@param a number
---@param b number
---@return number
function Rng:uniform(a, b) end

---Normally distributed.
---@param mean number
---@param sigma number
---@return number
function Rng:normal(mean, sigma) end

---Whole number, both ends included.
---@param low integer
---@param high integer
---@return integer
function Rng:int(low, high) end

---One of a list.
---@param list any[]
---@return any
function Rng:choice(list) end

---A copy in random order.
---@param list any[]
---@return any[]
function Rng:shuffle(list) end

---The scene that a layout or a shift builds.
---@class softvt.Scene
---@field objects softvt.Object[] The placed objects, in order.
---@field light softvt.Light The light on them.
---@field base number[] Place of the robot base. Expects a list of 3 numbers (m, world).
---@field start_q number[] Joint angles of the arm at the start. Expects a list of 7 numbers (rad).
---@field gravity number[] Gravity. Expects a list of 3 numbers (m/s², world).
---@field workspace_min number[] Lowest corner of the workspace. Expects a list of 3 numbers (m, world).
---@field workspace_max number[] Highest corner of the workspace. Expects a list of 3 numbers (m, world).
local Scene = {}

---Puts an asset somewhere.
---@param place softvt.Place
function Scene:add(place) end

---A placed object.
---@param name string
---@return softvt.Object
function Scene:object(name) end

---A camera; every scene has third_person and wrist.
---@param name string
---@return softvt.Camera
function Scene:camera(name) end

---One more camera.
---@param camera softvt.NewCamera
---@return softvt.Camera
function Scene:add_camera(camera) end

---The light of a scene: one key light and a sky. Its numbers may be read and written.
---@class softvt.Light
---@field direction number[] Direction to the key light. Expects a list of 3 numbers (world, any length).
---@field colour number[] Colour of the key light. Expects a list of 3 numbers (linear RGB).
---@field strength number Strength of the key light; 1 shows white at full value. Expects a number in 0..1000.
---@field softness number Half the angle under which it is seen. Expects radians in 0..0.5.
---@field sky_zenith number[] Light from straight above. Expects a list of 3 numbers (linear RGB).
---@field sky_horizon number[] Light from the horizon, and the backdrop. Expects a list of 3 numbers (linear RGB).
---@field sky_ground number[] Light from straight below. Expects a list of 3 numbers (linear RGB).
---@field sky_strength number Factor on the sky. Expects a number in 0..1000.
---@field exposure number Factor on the picture. Expects a number in above 0..1000.
local Light = {}

---A pinhole camera; its numbers may be read and written.
---@class softvt.Camera
---@field name string Its name.
---@field mount "world"|"hand" What it is fixed to.
---@field position number[] Where it is. Expects a list of 3 numbers (m, frame of the mount).
---@field quat number[] How it is turned: it looks along its −z, +y is up. Expects a list of 4 numbers (w, x, y, z, frame of the mount).
---@field fovy number Vertical field of view. Expects radians in 0.01..2.8.
---@field near number Nothing nearer is seen. Expects metres in 0.0001..100.
---@field far number Nothing farther is seen. Expects metres in 0.001..10000.
---@field width integer Width of the picture, pixels. Expects a whole number in 1..4096.
---@field height integer Height of the picture, pixels. Expects a whole number in 1..4096.
local Camera = {}

---Turns it to a point (m, frame of the mount); up, z if left out, is upwards in the picture.
---@param point number[]
---@param up? number[]
function Camera:look_at(point, up) end

---A material of a placed object; its numbers may be read and written, the layers over it stay.
---@class softvt.Look
---@field albedo number[] Base colour. Expects a list of 3 numbers (linear RGB in 0..1).
---@field roughness number Roughness, 0 a mirror. Expects a number in 0..1.
---@field metalness number Metalness. Expects a number in 0..1.
local Look = {}

---A placed object; its numbers may be read and written.
---@class softvt.Object
---@field name string Name in the scene.
---@field asset string Name of its asset.
---@field looks softvt.Look[] Its materials, in the order of the asset's visuals.
---@field joints table<string, number> Start values of its joints by part, m or rad.
---@field xyz number[] Its origin: lowest point, on the centre line. Expects a list of 3 numbers (m, world).
---@field yaw number Turn about the vertical. Expects radians.
---@field density number Density of a soft or rigid body. Expects a number (kg/m³) above 0.
---@field youngs_pa number Young's modulus of a soft body. Expects pascals above 0.
---@field poisson number Poisson's ratio of a soft body. Expects a number in 0..below 0.5.
---@field static_mu number Static friction coefficient. Expects a number in 0..10.
---@field dynamic_mu number Dynamic friction coefficient. Expects a number in 0..10.
local Object = {}

---Mass of a soft or rigid body, of one moving part of an articulated object, or of all of them, kg; nil for what never moves.
---@param part? string
---@return number?
function Object:mass(part) end

---Multiplies the density of a soft or rigid body, or of every moving part; what never moves stays as it is.
---@param factor number
function Object:scale_mass(factor) end

---The true scene at this control step, as an expert sees it.
---@class softvt.View
local View = {}

---An object.
---@param name string
---@return softvt.Seen
function View:object(name) end

---A part of an articulated object.
---@param object string
---@param part string
---@return softvt.Seen
function View:part(object, part) end

---All objects, in the order of the scene.
---@return softvt.Seen[]
function View:objects() end

---Metres (at most 0.2) between a hand at pose and the nearest object, and the name of that; negative inside.
---@param pose softvt.Pose
---@param options? softvt.Clearance
---@return number
---@return string?
function View:clearance(pose, options) end

---An object as an expert sees it, at one moment.
---@class softvt.Seen
---@field name string Name in the scene.
---@field asset string Name of its asset.
---@field xyz number[] Middle of its bounding box, world, m.
---@field size number[] Edge lengths of its bounding box at rest, m.
---@field yaw number Turn about the vertical, rad.
---@field hints table<string, number> Numbers that its asset gives to experts.
---@field joint number? Joint value of a part, m or rad.
---@field joints table<string, number> Joint values of an articulated object by part, m or rad.
---@field parts table<string, softvt.Seen> The parts of an articulated object by name.
local Seen = {}

---What an expert drives. Each motion lasts as many control steps as it needs.
---@class softvt.Arm
---@field pose softvt.Pose Measured pose of the tool centre point.
---@field target softvt.Pose Pose commanded last.
---@field closure number Closure commanded last, 0 open to 1 shut.
---@field gripping boolean Whether grasp was called last, not release or open.
---@field width number Measured distance of the pads, m.
---@field force number[] Normal force on the left and right pad, N.
---@field time number Time since the start, s.
---@field dt number Length of a control step, s.
local Arm = {}

---Sends one command and comes back at the next control step.
---@param pose softvt.Pose
---@param closure number
function Arm:command(pose, closure) end

---Moves straight and smoothly, at most at speed (m/s, 0.25) and turn (rad/s, 1.5).
---@param pose softvt.Pose
---@param options? {speed: number?, turn: number?, closure: number?}
function Arm:move_to(pose, options) end

---Moves by an offset in the world frame, m.
---@param offset number[]
---@param options? {speed: number?, turn: number?, closure: number?}
function Arm:move_by(offset, options) end

---Closes or opens at a rate (1/s, 0.5; 1 is the whole stroke in a second).
---@param closure number
---@param options? {rate: number?}
function Arm:close_to(closure, options) end

---Closes on an object; a binary gripper, which knows only open and shut, shuts here and not in close_to, and a tactile servo closes until both fingers feel that they hold something, whatever closure says.
---@param closure number
---@param options? {rate: number?}
function Arm:grasp(closure, options) end

---Lets go of an object, opening to a closure or wide.
---@param options? {rate: number?, closure: number?}
function Arm:release(options) end

---Opens the gripper.
---@param options? {rate: number?}
function Arm:open(options) end

---What the fingers feel now; the first time it waits for a control step. In simulation:drive and under --policy tactile-servo.
---@return {left: softvt.Touch, right: softvt.Touch}
function Arm:feel() end

---Holds still.
---@param seconds number
function Arm:wait(seconds) end

---Ends the expert: the last command stays, and the episode's record and the results say why.
---@param reason string
function Arm:give_up(reason) end

---A list that belongs to an object: scene.base, look.albedo, scene.objects. #, [i], ipairs, pairs, table.unpack and table.concat work on it, and it may be given wherever a list is expected. Numbers that may be written one by one go to the object at once: scene.base[1] = 0.1 is as good as scene.base = { 0.1, 0, 0 }. Any other list refuses to be written.
---@class softvt.List
local List = {}

---Which episode begins: what a policy is told of it.
---@class softvt.Brief
---@field suite string Name of the suite.
---@field task integer Index of the task, from 0.
---@field prompt string The instruction.
---@field episode integer Index of the episode, from 0.
local Brief = {}

---What a policy sees at a control step. Poses are of the tool centre point in the robot's base frame; hidden state has no field here.
---@class softvt.Observation
---@field time number Time since the policy took over, s.
---@field position number[] Tool position, m.
---@field axis_angle number[] Tool orientation as axis-angle, rad.
---@field rotation number[] The same as quaternion w, x, y, z with w of 0 or more.
---@field joints number[] The seven joint angles of the arm, rad.
---@field width number Measured distance of the gels, 0 to 0.08 m.
---@field closure number Closure commanded last, 0 open to 1 shut.
---@field prompt string The instruction.
---@field touch {left: softvt.Touch, right: softvt.Touch} What the fingers feel; with looks.touch.
---@field touch_history {left: softvt.Touch, right: softvt.Touch}[] The same of the last 1 to 8 control steps, oldest first; with looks.touch.
---@field force {left: number[], right: number[]} True forces on the gels, N, pad frame: a pressing body makes z negative; with looks.force.
local Observation = {}

---What a camera of looks.cameras sees, 224 × 224 unless the scene says otherwise.
---@param name string
---@return softvt.Image
function Observation:camera(name) end

---A finger's tactile sensor at one control step; docs/tactile.md draws its frames.
---@class softvt.Touch
---@field picture softvt.Image The colour picture, 320 × 240.
---@field change softvt.Image How far each channel of each pixel is from the untouched gel's picture.
---@field markers softvt.Markers The 11 × 9 markers.
local Touch = {}

---The 99 markers of a finger, row by row, in px of its picture: x to the right (to the hand), y down. 1 px is 0.063 mm.
---@class softvt.Markers
---@field initial number[][] Their places without a touch.
---@field present number[][] Their places now.
---@field motion number[][] How far each has moved.
local Markers = {}

---Mean motion along x and y: the gel is dragged along its surface.
---@return number[]
function Markers:mean() end

---The longest motion.
---@return number
function Markers:largest() end

---How hard the gel is pressed: root mean square of the motion that is neither mean nor twist. It grows with the normal force, about 0.3 px a newton on round dough and rigid things and less on what is flat and soft.
---@return number
function Markers:press() end

---How hard something is on its way out of the grasp: mean motion to the fingertip or across, 0 if it is pushed in.
---@return number
function Markers:drag() end

---Trace of the motion's gradient: positive where a dent pushes the markers outwards.
---@return number
function Markers:divergence() end

---Turn of the markers, rad: positive is clockwise in the picture.
---@return number
function Markers:twist() end

---Pure shear of the markers: stretch along x against y, and along the diagonal x = y.
---@return number[]
function Markers:shear() end

---Contact mask: which markers moved by more than px.
---@param px number
---@return boolean[]
function Markers:moved(px) end

---Share of the markers that moved by more than px; all of the picture is 20.3 × 15.2 mm.
---@param px number
---@return number
function Markers:area(px) end

---The softvt library.
softvt = {}

---Version of softvt.
---@type string
softvt.version = ""

---A set of tasks that are reported together.
---@param spec softvt.Suite
---@return softvt.Suite
function softvt.suite(spec) end

---One task of a suite.
---@param spec softvt.Task
---@return softvt.Task
function softvt.task(spec) end

---The object rests on the target, released, for a time.
---@param spec softvt.On
---@return softvt.On
function softvt.on(spec) end

---The object rests inside the target's walls, released, for a time.
---@param spec softvt.Inside
---@return softvt.Inside
function softvt.inside(spec) end

---A kind of object: its shape at rest with its lowest point at z = 0 and its centre on the z axis.
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

---Parts on joints; the asset's own shape is their base, which never moves.
---@param spec softvt.Articulated
---@return softvt.Articulated
function softvt.articulated(spec) end

---A joint along which a part slides, as a drawer does.
---@param spec softvt.Slider
---@return softvt.Slider
function softvt.slider(spec) end

---A joint about which a part turns, as a door or a knob does.
---@param spec softvt.Hinge
---@return softvt.Hinge
function softvt.hinge(spec) end

---A part of the world that never moves.
---@param spec softvt.Static
---@return softvt.Static
function softvt.static(spec) end

---Part of the picture only: it is drawn, casts shadows, and nothing touches it.
---@param spec softvt.Scenery
---@return softvt.Scenery
function softvt.scenery(spec) end

---A change of the scene that a run may ask for with --shift name=value. Thresholds stay nominal.
---@param spec softvt.Shift
---@return softvt.Shift
function softvt.shift(spec) end

---Runs suites as they are, then under each condition, and compares episode by episode.
---@param spec softvt.Conditions
---@return softvt.Conditions
function softvt.conditions(spec) end

---A function of a grid of parameters that yields rows. Give grid or points.
---@param spec softvt.Experiment
---@return softvt.Experiment
function softvt.experiment(spec) end

---A policy, which the file behind --policy returns. Every episode has a machine of its own, in which the file is run anew; math.random is seeded by the episode.
---@param spec softvt.Policy
---@return softvt.Policy
function softvt.policy(spec) end

---What a policy's server gets and what its numbers mean; the file behind --profile returns one.
---@param spec softvt.Profile
---@return softvt.Profile
function softvt.profile(spec) end

---A layout by name and function, or by a table of name and build.
---@param name string|softvt.Layout
---@param build? fun(scene: softvt.Scene, rng: softvt.Rng)
---@return softvt.Layout
function softvt.layout(name, build) end

---Declares the script's options; gives their values, from the command line or by default.
---@param options table<string, softvt.Option>
---@return table<string, any>
function softvt.options(options) end

---An empty world without a robot.
---@param world? softvt.WorldSpec
---@return softvt.World
function softvt.world(world) end

---A settled scene with the robot.
---@param simulate softvt.SimulateSpec
---@return softvt.Simulation
function softvt.simulate(simulate) end

---What a calibration found: lower, closure_at_tau, safe_window, tau, d_ref, and as text: text (a plot), sweep (JSON lines), json (a threshold file).
---@param envelope softvt.EnvelopeSpec
---@return table
function softvt.envelope(envelope) end

---What assets/calibration/<asset>.json says, as softvt.envelope gives it; nil if there is no such file.
---@param asset string
---@return table?
function softvt.calibration(asset) end

---Whether a row of a compression sweep is a stable squeeze.
---@param row table
---@return boolean
function softvt.stable(row) end

---An empty picture.
---@param image softvt.NewImage
---@return softvt.Image
function softvt.image(image) end

---A pose in the world frame.
---@param pose softvt.PoseSpec
---@return softvt.Pose
function softvt.pose(pose) end

---A shape from a mesh file.
---@param mesh softvt.MeshSpec
---@return softvt.Shape
function softvt.mesh(mesh) end

---Iterates over keys and values in an order that does not depend on hashes: numbers, strings, booleans. In a script, pairs does the same.
---@param t table
---@return fun(): any, any
function softvt.sorted(t) end

---Shapes, in metres.
softvt.shape = {}

---A box centred on the origin.
---@param spec softvt.BoxSpec
---@return softvt.Shape
function softvt.shape.box(spec) end

---A sphere centred on the origin.
---@param spec softvt.SphereSpec
---@return softvt.Shape
function softvt.shape.sphere(spec) end

---An ellipsoid centred on the origin.
---@param spec softvt.EllipsoidSpec
---@return softvt.Shape
function softvt.shape.ellipsoid(spec) end

---A capsule about the z axis, centred on the origin.
---@param spec softvt.CapsuleSpec
---@return softvt.Shape
function softvt.shape.capsule(spec) end

---A cylinder about the z axis, centred on the origin.
---@param spec softvt.CylinderSpec
---@return softvt.Shape
function softvt.shape.cylinder(spec) end

---A torus about the z axis, centred on the origin.
---@param spec softvt.TorusSpec
---@return softvt.Shape
function softvt.shape.torus(spec) end

---A triangular prism along y in a box centred on the origin.
---@param spec softvt.WedgeSpec
---@return softvt.Shape
function softvt.shape.wedge(spec) end

---A polygon in (x, z), drawn out along y, centred on y = 0.
---@param spec softvt.PrismSpec
---@return softvt.Shape
function softvt.shape.prism(spec) end

---A profile revolved about the z axis.
---@param spec softvt.LatheSpec
---@return softvt.Shape
function softvt.shape.lathe(spec) end

---Masks: where a layer of a visual is.
softvt.mask = {}

---Cubes, every other one 1; a corner lies at the origin.
---@param spec softvt.CheckerMask
---@return softvt.Mask
function softvt.mask.checker(spec) end

---Slabs across an axis.
---@param spec softvt.StripesMask
---@return softvt.Mask
function softvt.mask.stripes(spec) end

---Rises smoothly from 0 to 1 along an axis.
---@param spec softvt.GradientMask
---@return softvt.Mask
function softvt.mask.gradient(spec) end

---Cloudy noise; its values lie about 0.5, few below 0.2 or above 0.8.
---@param spec softvt.NoiseMask
---@return softvt.Mask
function softvt.mask.noise(spec) end

---Year rings of a trunk: cylinders about a line along z, bent by noise.
---@param spec softvt.RingsMask
---@return softvt.Mask
function softvt.mask.rings(spec) end

---Boards that lie along x, side by side in y: one value a board.
---@param spec softvt.BoardsMask
---@return softvt.Mask
function softvt.mask.boards(spec) end

---The gaps between boards of these sizes.
---@param spec softvt.SeamsMask
---@return softvt.Mask
function softvt.mask.seams(spec) end

---Round specks, strewn about.
---@param spec softvt.SpecksMask
---@return softvt.Mask
function softvt.mask.specks(spec) end

---A plain weave in x and y: high in the middle of a thread.
---@param spec softvt.WeaveMask
---@return softvt.Mask
function softvt.mask.weave(spec) end

---Where the surface faces a direction, by the cosine between its normal and that.
---@param spec softvt.FacingMask
---@return softvt.Mask
function softvt.mask.facing(spec) end

---Where a shape is: a painted rim, the grooves between ridges.
---@param spec softvt.InsideMask
---@return softvt.Mask
function softvt.mask.inside(spec) end

---The letters of a line of text, printed on what faces who reads it. Surfaces with text are drawn with finer detail than others.
---@param spec softvt.TextMask
---@return softvt.Mask
function softvt.mask.text(spec) end
