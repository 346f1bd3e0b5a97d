# SPDX-License-Identifier: MIT
"""manipulator: a three-joint arm (waist, shoulder, elbow) in MuJoCo carries loads between postures.

The commands are the joint torques that a controller asks of the motor drives: proportional and
derivative, with gravity and inertia from its own copy of the arm. What the controller reads are
the true angles. Loads are picked up and put down at random stops; the command u.load_kg says so.
"""
import mujoco
import numpy as np
from base import Machine, Physical, clip, jitter

XML = """
<mujoco model="manipulator">
  <option timestep="0.002" integrator="implicitfast" gravity="0 0 -9.81"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <body name="waist" pos="0 0 .3">
      <joint name="j0" type="hinge" axis="0 0 1" armature=".35" damping="2.0" frictionloss="1.5"/>
      <geom type="cylinder" size=".08 .12" mass="6"/>
      <body name="upper" pos="0 0 .12">
        <joint name="j1" type="hinge" axis="0 -1 0" armature=".5" damping="2.5" frictionloss="2.0"/>
        <geom type="capsule" fromto="0 0 0 .45 0 0" size=".05" mass="4.5"/>
        <body name="fore" pos=".45 0 0">
          <joint name="j2" type="hinge" axis="0 -1 0" armature=".2" damping="1.2"
                 frictionloss="1.0"/>
          <geom type="capsule" fromto="0 0 0 .40 0 0" size=".035" mass="2.2"/>
          <body name="load" pos=".42 0 0">
            <geom name="load" type="sphere" size=".04" mass="1.0"/>
            <site name="tip"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor joint="j0"/><motor joint="j1"/><motor joint="j2"/>
  </actuator>
  <sensor><force site="tip"/></sensor>
</mujoco>
"""
TORQUE = (1.6, 2.2, 1.1)     # Nm per A at the joint
WINDING = (.9, .8, 1.2)      # Ohm
STIFF, DAMP = np.array([160., 260., 120.]), np.array([22., 32., 14.])    # Nm/rad, Nm s/rad
INTEGRATE = np.array([60., 100., 50.])                                   # Nm/rad/s
FASTEST = (.8, .45, .7)      # rad/s, of a leg's mean


class Copy:
    """The controller's own arm, without dispersions, for gravity and inertia on paper."""
    def __init__(self):
        self.model = mujoco.MjModel.from_xml_string(XML)
        self.data = mujoco.MjData(self.model)
        self.full = np.zeros((3, 3))

    def carry(self, body, mass, inertia):
        self.model.body_mass[body], self.model.body_inertia[body] = mass, inertia
        mujoco.mj_setConst(self.model, self.data)

    def torque(self, angles, acceleration):
        """What holds the arm at these angles, and what accelerates it, in Nm."""
        self.data.qpos[:], self.data.qvel[:] = angles, 0
        mujoco.mj_forward(self.model, self.data)
        mujoco.mj_fullM(self.model, self.data, self.full)
        return self.data.qfrc_bias + self.full @ np.array(acceleration)


class Manipulator(Machine):
    """The arm for 120 s.

    Strengths: payload: kg more than the command says; bearing: share by which the waist's friction
    rises; winding: share of current more for the same torque; cable: Nm against the elbow; rub: Nm
    of friction at the waist; hotmotor: share of torque lost.
    """
    RATE, LENGTH = .05, 2400
    CONTROL, STEPS = 5, 5      # controller's turns a row, steps of 2 ms a turn
    COLUMNS = ["t_s", "u.torque0_Nm", "u.torque1_Nm", "u.torque2_Nm", "u.load_kg", "x.room_degC",
               "s.waist_rad", "s.shoulder_rad", "s.elbow_rad", "s.waistrate_radps",
               "s.shoulderrate_radps", "s.elbowrate_radps", "s.current0_A", "s.current1_A",
               "s.current2_A", "s.wrist_N", "s.motor1_degC", "s.bus_V"]
    SIGMA = dict(room=.1, waist=.004, shoulder=.004, elbow=.004, waistrate=.015, shoulderrate=.015,
                 elbowrate=.02, current0=.12, current1=.25, current2=.20, wrist=.5, motor1=.4,
                 bus=.06)
    TAUS, LAG, LAG_MEAN = (.1, .5, 10), .25, .05
    SHAPE = dict(bearing="s.waistrate_radps", rub="s.waistrate_radps")
    PHYSICAL = {
        "payload": Physical(.12, .18,
                            dict(wrist=1, shoulderrate=-1, shoulder=0, elbowrate=-1, elbow=0)),
        "bearing": Physical(.8, 1.1, dict(waistrate=0, waist=0)),
        "winding": Physical(.05, .07, dict(current2=1)),
        "cable": Physical(2.0, 3.0, dict(elbowrate=-1, elbow=0), ("s.elbow_rad",), False),
        "hotmotor": Physical(.08, .11, dict(shoulderrate=-1, shoulder=0),
                             ("s.motor1_degC", "u.torque1_Nm"), False),
        "rub": Physical(2.0, 3.0, dict(waistrate=0, waist=0),
                        ("s.waist_rad", "s.shoulder_rad"), False),
    }
    FAULTS = ("bias:current1", "drift:wrist", "stuck:shoulder", "payload", "bearing", "winding",
              "cable", "hotmotor", "rub")

    def __init__(self, r):
        self.mass = [jitter(r, 1, .003) for _ in range(3)]
        self.friction = [jitter(r, 1, .02) for _ in range(3)]
        self.damping = [jitter(r, 1, .02) for _ in range(3)]
        self.torque = np.array([jitter(r, k, .004) for k in TORQUE])
        self.drive = [jitter(r, 1, .004) for _ in range(3)]
        self.cooling = jitter(r, 1, .02)
        self.room = r.uniform(21, 22)
        self.temperature = self.room + r.uniform(4, 10)
        self.volts = 48 + r.gauss(0, .2)
        self.legs, t = [], 2.0     # begin and length in s, angles from and to, load in kg
        at = self.start = [0., .6, -.9]
        load = r.uniform(.8, 1.2)
        while t < 130:
            to = [r.uniform(-1.5, 1.5), r.uniform(.05, 1.15), r.uniform(-1.6, -.2)]
            slowest = max(abs(a - b) / m for a, b, m in zip(at, to, FASTEST))
            span = slowest * r.uniform(1.0, 1.5) + .6
            self.legs.append((t, span, at, to, load))
            t += span + r.uniform(.3, 1.5)
            if r.random() < .5:
                load = r.choice((.2, r.uniform(.8, 1.2), r.uniform(1.2, 2.0)))
            at = to
        self.noise = np.random.default_rng(r.randrange(1 << 30))

    def target(self, t):
        """Angles, rates and accelerations that are wanted, and the load in kg, at the time t."""
        now = None
        for leg in self.legs:
            if leg[0] > t:
                break
            now = leg
        if now is None:
            return np.array(self.start), np.zeros(3), np.zeros(3), self.legs[0][4]
        begin, span, a, b, load = now
        x = clip((t - begin) / span, 0, 1)
        way = 10 * x**3 - 15 * x**4 + 6 * x**5
        rate = (30 * x**2 - 60 * x**3 + 30 * x**4) / span
        acceleration = (60 * x - 180 * x**2 + 120 * x**3) / span**2
        start, whole = np.array(a), np.array(b) - np.array(a)
        return start + whole * way, whole * rate, whole * acceleration, load

    def built(self):
        """The arm with this run's dispersions: its model and data."""
        model = mujoco.MjModel.from_xml_string(XML)
        data = mujoco.MjData(model)
        for i, name in enumerate(("waist", "upper", "fore")):
            body = model.body(name).id
            model.body_mass[body] *= self.mass[i]
            model.body_inertia[body] *= self.mass[i]
        self.friction = model.dof_frictionloss.copy() * self.friction
        self.damping = model.dof_damping.copy() * self.damping
        self.load = model.body("load").id
        self.load_mass = model.body_mass[self.load]
        self.load_inertia = model.body_inertia[self.load].copy()
        data.qpos[:] = self.start
        self.copy, self.loaded = Copy(), None
        self.integral, self.sway, self.amps = np.zeros(3), np.zeros(3), np.zeros(3)
        return model, data

    def carry(self, model, load, extra):
        """Hangs the load on the arm, and what the controller knows of it on its copy; in kg."""
        if self.loaded == (load, extra):
            return
        self.loaded = load, extra
        model.body_mass[self.load] = (load + extra) * self.load_mass
        model.body_inertia[self.load] = (load + extra) * self.load_inertia
        self.copy.carry(self.load, load * self.load_mass, load * self.load_inertia)

    def ask(self, data, want, rate, acceleration):
        """The torques that the controller asks for, in Nm."""
        off = want - data.qpos
        self.integral = np.clip(self.integral + INTEGRATE * off * self.RATE / self.CONTROL, -8, 8)
        torque = self.copy.torque(data.qpos, acceleration) + STIFF * off \
            + DAMP * (rate - data.qvel) + self.integral + np.tanh(rate / .05) * (1.5, 2.0, 1.0)
        return np.clip(torque, (-60, -110, -45), (60, 110, 45))

    def damage(self, model, data, fault, strength, edges, begun, ask):
        """Lets the fault act on the friction; (whether it acts, and what it does to the motors:
        factors of their current and of their torque per ampere, and a torque in Nm)."""
        amps, torque, pull = np.ones(3), np.ones(3), np.zeros(3)
        model.dof_frictionloss[:], model.dof_damping[:] = self.friction, self.damping
        waist, shoulder, elbow = data.qpos
        inside = bool(fault) and begun
        if fault == "bearing":
            model.dof_frictionloss[0] *= 1 + strength * inside
        elif fault == "winding":   # shorted turns: more amperes for the same torque
            amps[2] = 1 + strength * inside
        elif fault == "cable":     # a stiff cable pulls the elbow back where it is stretched
            inside = inside and elbow > -.9 + .25 * edges[0]
            pull[2] = strength * inside
        elif fault == "hotmotor":  # hot magnets are weak
            inside = inside and self.temperature > 28.8 + .9 * edges[1] and ask[1] > 20
            torque[1] = 1 - strength * inside
        elif fault == "rub":
            low = shoulder < .25 + .25 * edges[1] + .35
            inside = inside and waist > -.6 + .6 * edges[0] and low
            model.dof_frictionloss[0] += strength * inside
        return bool(inside), amps, torque, pull

    def turn(self, model, data, ask, effect):
        """The drives, the arm and the motor's heat until the controller's next turn."""
        amps, torque, pull = effect
        drawn = ask * self.drive / TORQUE * amps
        self.sway += -self.sway * .01 / 2 + self.noise.normal(0, .02, 3) * (1, 1.4, .7)
        data.ctrl[:] = drawn / amps * (self.torque * torque) + self.sway - pull
        for _ in range(self.STEPS):
            mujoco.mj_step(model, data)
        self.amps += .3 * (drawn - self.amps)
        heat = .8 * .9 * self.amps[1] ** 2 - 14 * self.cooling * (self.temperature - self.room)
        self.temperature += .01 * heat / 420

    def rows(self, fault, strength, edges, onset):
        model, data = self.built()
        out, acts = [], []
        for k in range(self.LENGTH):
            for j in range(self.CONTROL):
                t = k * self.RATE + j * self.RATE / self.CONTROL
                want, rate, acceleration, load = self.target(t)
                begun = t >= onset
                self.carry(model, load, strength if fault == "payload" and begun else 0.)
                ask = self.ask(data, want, rate, acceleration)
                act, *effect = self.damage(model, data, fault, strength, edges, begun, ask)
                self.turn(model, data, ask, effect)
            wrist = float(np.linalg.norm(data.sensordata[:3]))
            watts = float(np.sum(ask * data.qvel) + np.sum(np.array(WINDING) * self.amps ** 2))
            bus = self.volts - .012 * watts / 4
            out.append((*ask, load, self.room, *data.qpos, *data.qvel, *self.amps, wrist,
                        self.temperature, bus))
            acts.append(act)
        return out, acts
