# ruff: noqa: D102 (the methods are documented in lerobot's Robot)
"""The smallest robot of lerobot: one servo on lerobot's own motor bus.

Everything that talks to the servo is lerobot's: its ``Robot``, its
``DynamixelMotorsBus``, its calibration, ROBOTIS's SDK below. The servo is simulated.
"""

from dataclasses import dataclass

from lerobot.motors import Motor, MotorCalibration, MotorNormMode
from lerobot.motors.dynamixel import DynamixelMotorsBus, OperatingMode
from lerobot.robots import Robot, RobotConfig

#: Half a turn about the center of an XL430, 4096 ticks a turn.
CALIBRATION = {"gripper": MotorCalibration(1, 0, 0, 1024, 3072)}


@RobotConfig.register_subclass("one_servo")
@dataclass
class OneServoConfig(RobotConfig):
    """Its port, as for the followers of lerobot."""

    port: str
    disable_torque_on_disconnect: bool = True


class OneServo(Robot):
    """A gripper, 0 to 100 between the ends of its calibration."""

    config_class = OneServoConfig
    name = "one_servo"

    def __init__(self, config):
        super().__init__(config)
        self.config = config
        self.bus = DynamixelMotorsBus(
            config.port,
            {"gripper": Motor(1, "xl430-w250", MotorNormMode.RANGE_0_100)},
            CALIBRATION,
        )

    @property
    def observation_features(self):
        return {"gripper.pos": float}

    @property
    def action_features(self):
        return {"gripper.pos": float}

    @property
    def is_connected(self):
        return self.bus.is_connected

    @property
    def is_calibrated(self):
        return self.bus.is_calibrated

    def connect(self, calibrate=True):
        self.bus.connect()
        if not self.is_calibrated and calibrate:
            self.calibrate()
        self.configure()

    def calibrate(self):
        with self.bus.torque_disabled():
            self.bus.write_calibration(CALIBRATION)

    def configure(self):
        # As the followers of lerobot do, which leaves torque on.
        with self.bus.torque_disabled():
            self.bus.configure_motors()
            self.bus.write("Operating_Mode", "gripper", OperatingMode.POSITION.value)

    def get_observation(self):
        seen = self.bus.sync_read("Present_Position")
        return {f"{motor}.pos": value for motor, value in seen.items()}

    def send_action(self, action):
        goal = {name.removesuffix(".pos"): value for name, value in action.items()}
        self.bus.sync_write("Goal_Position", goal)
        return action

    def disconnect(self):
        self.bus.disconnect(self.config.disable_torque_on_disconnect)
