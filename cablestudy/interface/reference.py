"""Tables of the commands validate, keys, columns and materials, which compute nothing."""

from cablestudy.study.columns import columns_table as columns_table
from cablestudy.study.files import key_table as key_table
from cablestudy.study.files import materials_table as materials_table
from cablestudy.study.files import validate_table as validate_table
