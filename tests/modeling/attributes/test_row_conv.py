"""A convolution along a row is torch's own Conv1d, in values and gradients."""

import pytest
import torch
from torch.nn import functional

from palpate.modeling.attributes.hv_net import RowConv

pytestmark = pytest.mark.needs("torch")


@pytest.mark.parametrize("filters", [1, 6])
@pytest.mark.parametrize("bias", [True, False])
@pytest.mark.parametrize(("kernel", "places"), [(1, 4), (3, 1), (3, 7), (4, 2), (4, 9)])
def test_it_is_a_convolution_with_zeros_beyond_the_ends(filters, bias, kernel, places):
    torch.manual_seed(1)
    layer = RowConv(5, filters, kernel, bias=bias).double()
    x = torch.randn(2, 3, places, 5, dtype=torch.float64, requires_grad=True)
    padded = functional.pad(x.flatten(0, 1).transpose(1, 2), (kernel // 2, (kernel - 1) // 2))
    plain = functional.conv1d(padded, layer.weight, layer.bias).transpose(1, 2).unflatten(0, (2, 3))
    found = layer(x)
    torch.testing.assert_close(found, plain, rtol=0, atol=1e-14)
    slope = torch.randn_like(found)
    wanted = torch.autograd.grad(plain, (x, *layer.parameters()), slope)
    for one, other in zip(torch.autograd.grad(found, (x, *layer.parameters()), slope), wanted, strict=True):
        torch.testing.assert_close(one, other, rtol=0, atol=1e-13)
