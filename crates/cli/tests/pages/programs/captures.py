# Two captures of one way, sender.pcap and receiver.pcap: 300 datagrams, one each millisecond, some 20 ms on their way.
import struct

UDP = struct.pack(">HHHH", 5001, 5000, 8 + 8, 0)


def address(last):
    return bytes([10, 0, 0, last])


def write(name, times):
    with open(name, "wb") as file:
        file.write(struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 101))
        for number, micros in times:
            ip = struct.pack(">BBHHHBBH", 0x45, 0, 36, number, 0, 64, 17, 0) + address(1) + address(2)
            packet = ip + UDP + struct.pack(">Q", number)
            file.write(struct.pack("<IIII", micros // 1000000, micros % 1000000, len(packet), len(packet)) + packet)


sent = [(number, 1000 * number) for number in range(300)]
write("sender.pcap", sent)
# Delays by arithmetic, so that they are the same everywhere.
write("receiver.pcap", [(number, micros + 20000 + number * number * 7919 % 907) for number, micros in sent if number % 50 != 7])
