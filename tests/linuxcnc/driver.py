#!/usr/bin/python3
"""LinuxCNC's [DISPLAY] program of a test: does the steps of plan.json, writes report.json.

LinuxCNC starts it, and shuts down when it returns. It runs under the system's Python, to which the
modules `linuxcnc` and `hal` belong, and knows nothing of truepose: what is to be done, and what
to be read, stands in the plan; what it means is judged by the test.

Motion's time is servo cycles, here of 1 ms, and not the clock's: without a real-time kernel, on a
busy machine, LinuxCNC may stand still for a while. So waiting is counted in cycles.
"""

import json
import subprocess
import sys
import time
import traceback
from pathlib import Path

import hal

import linuxcnc

command, stat, messages = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()


class Driver:
    """One method a kind of step; a step's other keys are its arguments."""

    def __init__(self, joints, axes):
        self.joints, self.axes = joints, axes
        self.readings, self.errors = {}, []
        self.sampling = None
        self.patience = 30.0  # s

    def step(self, do, **given):
        getattr(self, do)(**given)

    def home(self):
        self.until(lambda: stat.task_state == linuxcnc.STATE_ESTOP and stat.joints == self.joints)
        command.state(linuxcnc.STATE_ESTOP_RESET)
        command.wait_complete()
        command.state(linuxcnc.STATE_ON)
        command.wait_complete()
        self.until(lambda: stat.task_state == linuxcnc.STATE_ON)
        command.teleop_enable(0)
        command.wait_complete()
        command.home(-1)
        command.wait_complete()
        self.until(lambda: all(stat.homed[: self.joints]))
        self.mdi("G21 G90 G17 G64 P0.005")

    def rehome(self, label):
        """Home all joints where they stand, in joint mode, and say whether LinuxCNC did."""
        self.joint_mode()
        self.drain()
        before = len(self.errors)
        command.home(-1)
        command.wait_complete()
        self.until(lambda: not any(self.homing()) and all(stat.homed[: self.joints]))
        self.wait(30)
        self.drain()
        self.readings[label] = {"refused": self.errors[before:]}
        del self.errors[before:]

    def homing(self):
        return [stat.joint[number]["homing"] for number in range(self.joints)]

    def power(self, cycles):
        """Off, and on again after so many cycles."""
        command.state(linuxcnc.STATE_OFF)
        command.wait_complete()
        self.until(lambda: stat.task_state != linuxcnc.STATE_ON)
        self.wait(cycles)
        command.state(linuxcnc.STATE_ON)
        command.wait_complete()
        self.until(lambda: stat.task_state == linuxcnc.STATE_ON)
        self.world_mode()

    def jog_axis(self, axis, velocity, cycles):
        """Along an axis of the tool for so many cycles, or to its limit."""
        command.mode(linuxcnc.MODE_MANUAL)
        command.wait_complete()
        command.teleop_enable(1)
        command.wait_complete()
        self.until(lambda: stat.motion_mode == linuxcnc.TRAJ_MODE_TELEOP)
        number = "XYZABCUVW".index(axis)
        command.jog(linuxcnc.JOG_CONTINUOUS, False, number, velocity)
        self.wait(cycles)
        command.jog(linuxcnc.JOG_STOP, False, number)
        command.wait_complete()
        self.world_mode()
        self.until(lambda: stat.inpos)

    def jog_joint(self, joint, velocity, distance):
        """There and back, joint by joint."""
        self.joint_mode()
        for sign in (1, -1):
            command.jog(linuxcnc.JOG_INCREMENT, True, joint, velocity, sign * distance)
            self.wait(20)
            self.until(lambda: stat.joint[joint]["inpos"] and stat.inpos)
        self.world_mode()

    def series(self, steps, cycles):
        """The steps one after another, over again, until so many cycles have passed.

        Stops at a machine that has tripped, and at the first message of LinuxCNC.
        """
        self.patience = 120.0
        start, done = self.cycle(), 0
        while self.cycle() - start < cycles:
            given = steps[done % len(steps)]
            self.step(**given)
            done += 1
            self.drain()
            stat.poll()
            if self.errors or stat.task_state != linuxcnc.STATE_ON:
                raise RuntimeError(f"tripped at step {done}, {given}: {self.errors}")
            if done % 1000 == 0:
                print(f"{done} steps, {(self.cycle() - start) / 60e3:.1f} min", flush=True)
        self.readings["series"] = {"steps": done, "cycles": self.cycle() - start}

    def until_pin(self, pin, value):
        """Until a pin has that value."""
        self.until(lambda: hal.get_value(pin) == value)

    def mdi(self, text):
        command.mode(linuxcnc.MODE_MDI)
        command.wait_complete()
        command.mdi(text)
        if command.wait_complete(self.patience) == -1:
            raise RuntimeError("not done in time: " + text)
        self.until(lambda: stat.inpos and stat.interp_state == linuxcnc.INTERP_IDLE)

    def joint_mode(self):
        """Joints are moved one by one, and LinuxCNC asks for the forward solution only."""
        command.mode(linuxcnc.MODE_MANUAL)
        command.wait_complete()
        command.teleop_enable(0)
        command.wait_complete()
        self.until(lambda: stat.motion_mode == linuxcnc.TRAJ_MODE_FREE)

    def world_mode(self):
        command.mode(linuxcnc.MODE_MDI)
        command.wait_complete()
        self.until(lambda: stat.motion_mode == linuxcnc.TRAJ_MODE_COORD)
        self.wait(100)

    def wait(self, cycles):
        self.until_cycle(self.cycle() + cycles)

    def until_cycle(self, cycle):
        self.until(lambda: self.cycle() >= cycle)

    @staticmethod
    def cycle():
        """Servo cycles, from any start: once homed, each asks for the forward solution once."""
        return hal.get_value("truepose.forward-calls")

    def until_off(self, cycles):
        """Until the machine trips, for at most so many cycles."""
        last = self.cycle() + cycles
        self.until(lambda: stat.task_state != linuxcnc.STATE_ON or self.cycle() >= last)

    def set(self, name, value):
        hal.set_p(name, str(value))

    def signal(self, name, value):
        self.halcmd("sets", name, str(value))

    def unlink(self, pin):
        self.halcmd("unlinkp", pin)

    def link(self, signal, pin):
        self.halcmd("net", signal, pin)

    def settle(self):
        """Until no compensation has moved for 50 cycles.

        In joint mode the pose, and with it the compensation, moves by rounding for ever.
        """
        self.wait(5)  # until the pins are read
        last, since = None, self.cycle()

        def still():
            nonlocal last, since
            now = [hal.get_value(f"truepose.compensation-{n}") for n in range(self.joints)]
            if last is None or max(abs(a - b) for a, b in zip(now, last, strict=True)) > 1e-10:
                last, since = now, self.cycle()
            return self.cycle() - since > 50

        self.until(still)

    def read(self, label, pins=(), moving=False):
        if not moving:
            self.wait(30)
            self.until(self.told)
        stat.poll()
        self.drain()
        self.readings[label] = {
            "joints": list(stat.joint_position[: self.joints]),
            "feedback": list(stat.joint_actual_position[: self.joints]),
            "world": [stat.actual_position["XYZABCUVW".index(axis)] for axis in self.axes],
            "on": stat.task_state == linuxcnc.STATE_ON,
            "kinematics": stat.kinematics_type,
            "errors": list(self.errors),
            "pins": {pin: hal.get_value(pin) for pin in pins},
        }

    def told(self):
        """Whether task has copied the status that motion now has."""
        now = [hal.get_value(f"joint.{n}.pos-cmd") for n in range(self.joints)]
        told = stat.joint_position[: self.joints]
        return max(abs(a - b) for a, b in zip(now, told, strict=True)) < 1e-10

    def sample(self, file):
        self.drain()
        with Path(file).open("w") as trace:
            self.sampling = subprocess.Popen(["/usr/bin/halsampler"], stdout=trace)
        hal.set_p("sampler.0.enable", "1")
        self.wait(20)

    def stop_sampling(self):
        hal.set_p("sampler.0.enable", "0")
        time.sleep(0.3)
        self.sampling.terminate()
        self.sampling.wait()
        self.sampling = None
        overruns = hal.get_value("sampler.0.overruns")
        if overruns:
            raise RuntimeError(f"{overruns} cycles were not sampled")

    def program(self, file, during=()):
        """Run a program; steps `during` it, each {"after": cycles since its start, ...}."""
        command.mode(linuxcnc.MODE_AUTO)
        command.wait_complete()
        command.program_open(file)
        command.auto(linuxcnc.AUTO_RUN, 0)
        self.until(lambda: stat.interp_state != linuxcnc.INTERP_IDLE)
        start = self.cycle()
        for given in during:
            given = dict(given)
            self.until_cycle(start + given.pop("after"))
            self.step(**given)
        stat.poll()
        self.readings["still running"] = stat.interp_state != linuxcnc.INTERP_IDLE
        self.until(lambda: stat.interp_state == linuxcnc.INTERP_IDLE and stat.inpos)

    def until(self, true):
        start = time.monotonic()
        while True:
            stat.poll()
            if true():
                return
            if time.monotonic() - start > self.patience:
                raise RuntimeError("waited in vain")
            time.sleep(0.002)

    def drain(self):
        while message := messages.poll():
            self.errors.append(message[1])

    @staticmethod
    def halcmd(*words):
        subprocess.run(["/usr/bin/halcmd", *words], check=True)


def main():
    plan = json.loads(Path("plan.json").read_text())
    component = hal.component("test-driver")
    component.ready()
    driver = Driver(plan["joints"], plan["axes"])
    report = {"failed": None}
    for step in plan["steps"]:
        try:
            driver.step(**step)
        except Exception:
            driver.drain()
            report["failed"] = {"step": step, "why": traceback.format_exc()}
            break
    driver.drain()
    report.update(readings=driver.readings, errors=driver.errors)
    Path("report.json").write_text(json.dumps(report))
    return 0


if __name__ == "__main__":
    sys.exit(main())
