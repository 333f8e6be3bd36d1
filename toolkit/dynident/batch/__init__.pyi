from .evaluation import Evaluation as Evaluation
from .evaluation import wish as wish
from .joint_tree import JointTree as JointTree
from .kernel import Kernel as Kernel
from .kernel import evaluations as evaluations
from .kernel import regressor_kernel as regressor_kernel
from .kernel import torque_kernel as torque_kernel
from .memory import side_by_side as side_by_side
